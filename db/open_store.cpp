// See open_store.h.
#include "db/open_store.h"

#include "db/sqlite/sqlite_store.h"

namespace retake {

std::unique_ptr<Store> open_store(const std::string& place, const StoreOptions& options) {
  return std::make_unique<database::SqliteStore>(place, options);
}

}  // namespace retake
