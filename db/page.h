// Page: a part of a listing, and where the next one begins.
// doc/design.md, section 5.
#pragma once

#include <string>
#include <vector>

namespace retake {

enum class SampleOrder { newest, oldest, likely };

template <typename Record>
struct Page {
  std::vector<Record> records;
  std::string next_cursor;  ///< empty at the end
};

}  // namespace retake
