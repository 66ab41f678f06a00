// Cursors: where a listing goes on, as opaque text that only this store can have written.
// Realises doc/design.md, section 5: pages go by the last key, so they stay put while rows are added.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace retake::database {

/// The listings that have pages; the value is written into the cursors.
enum class Listing : char { scenarios = 's', chains = 'c', newest = 'n', oldest = 'o', likely = 'l' };

/// The key of the last record of a page.
struct Cursor {
  Listing listing = Listing::newest;
  std::int64_t scenario = 0;  ///< row of the scenario whose chains or samples are listed, 0 for scenarios
  std::int64_t row = 0;
  double log_target = 0;  ///< of `likely` only
};

std::string encode(const Cursor& cursor);
/// Throws: BadCursor if the text is not a cursor of this listing.
Cursor decode_cursor(std::string_view text, Listing listing, std::int64_t scenario);

}  // namespace retake::database
