// What every Store has to hold to: suites that derive from StoreTest run over each kind of store there is.
// A new kind is one line in kKindsOfStore. doc/design.md, section 5.
#pragma once

#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "db/sqlite/sqlite_store.h"
#include "db/store.h"
#include "tests/db/fixture.h"

namespace retake::test {

struct KindOfStore {
  const char* name;
  /// Opens the store of that name within the directory, a new one the first time.
  std::unique_ptr<Store> (*open)(const TemporaryDirectory& directory, const std::string& name,
                                 const StoreOptions& options);
};

inline const KindOfStore kKindsOfStore[] = {
    {"sqlite",
     [](const TemporaryDirectory& directory, const std::string& name,
        const StoreOptions& options) -> std::unique_ptr<Store> {
       return std::make_unique<database::SqliteStore>(directory.file(name), options);
     }},
};

/// A new store of the kind under test, for tests that share no more than that.
class EveryStore : public testing::TestWithParam<KindOfStore> {
 protected:
  std::unique_ptr<Store> open(const StoreOptions& options = {}, const std::string& name = "retake.db") const {
    return GetParam().open(directory, name, options);
  }
  TemporaryDirectory directory;
};

/// A store that commits every sample at once.
class StoreTest : public EveryStore {
 protected:
  std::unique_ptr<Store> opened = open(prompt());
  Store& store = *opened;
};

/// Without a prefix, so that suites keep the names by which they are chosen.
#define RETAKE_FOR_EVERY_STORE(suite)                                 \
  INSTANTIATE_TEST_SUITE_P(, suite, testing::ValuesIn(kKindsOfStore), \
                           [](const auto& of) { return std::string(of.param.name); })

}  // namespace retake::test
