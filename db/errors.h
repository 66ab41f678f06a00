// What a Store throws: the environment failed, or the caller is wrong.
// doc/design.md, section 5. Callers must not learn from them which database it is.
#pragma once

#include <stdexcept>

namespace retake {

/// The store cannot do what was asked: names the operation and the thing (file, table), never SQL.
class StoreError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The disk does not let the store do it just now: it is full, read-only, failing, or the file is not where
/// it was. The same call may succeed later.
class StoreUnavailable : public StoreError {
 public:
  using StoreError::StoreError;
};

/// What was asked for is damaged in the store, for good: what() names the thing and the column. Nothing of it
/// may be taken for true.
class Damaged : public StoreError {
 public:
  using StoreError::StoreError;
};

/// A page cursor that this store did not hand out, or handed out for another listing.
class BadCursor : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// An idempotency key came again with another request.
class IdempotencyConflict : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

}  // namespace retake
