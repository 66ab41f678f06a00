// open_store: the one place that knows which databases there are.
// doc/design.md, section 5.
#pragma once

#include <memory>
#include <string>

#include "db/store.h"
#include "db/store_options.h"

namespace retake {

/// Opens the store at `place`, the path of an SQLite file; creates or migrates its schema.
/// A store on a disk that is full or read-only is opened, too: what it holds can be read, and writing works
/// as soon as the disk lets it.
/// Throws: StoreError if another daemon holds it, if it is not a Retake store, or if its schema is newer.
std::unique_ptr<Store> open_store(const std::string& place, const StoreOptions& options = {});

}  // namespace retake
