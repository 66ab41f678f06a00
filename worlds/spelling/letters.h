// Letters: a dot face for a text, and its layout in a box of bins.
// Paper, section 5.3, figures 5 and 8. It must not know balls.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace retake::spelling {

/// Which bins of a box are designated, row by row from the top of the letters.
struct BinPattern {
  int columns = 0;
  int rows = 0;
  std::vector<bool> designated{};  ///< columns * rows

  std::size_t index(int column, int row) const { return static_cast<std::size_t>(row * columns + column); }
  /// How many are designated.
  int count() const;
  /// Lines of '#' (designated) and '.', one for each row.
  std::vector<std::string> lines() const;
};

/// The pattern that lines of '#' and '.' say. Requires: at least one line, all of one length, no other
/// character.
BinPattern pattern_of(const std::vector<std::string>& lines);

/// Latin letters in capitals: the face has no others.
std::string in_capitals(std::string_view text);

/// The characters of a text that the face does not have, each once, in the text's order. A sequence of bytes
/// that is one UTF-8 character is one character here.
std::vector<std::string> unknown_characters(std::string_view text);

/// So many bins.
struct TextSize {
  int columns = 0;
  int rows = 0;
};
/// The bins that a text takes at least, without a margin. Requires: no unknown characters.
TextSize least_size(std::string_view text);

/// The box for a text: in the tallest face that `most_columns` have room for, with a bin free on every side
/// as far as they have. None: there is no such face. Requires: no unknown characters.
std::optional<TextSize> room_for(std::string_view text, int most_columns);

/// A text in the middle of a box. There is a face of five rows and one of three, which has letters and few
/// signs: the taller one that leaves a row free above and below is used, else the taller one that fits.
/// None: the text does not fit. Requires: no unknown characters; columns and rows positive.
std::optional<BinPattern> lay_out(std::string_view text, int columns, int rows);

}  // namespace retake::spelling
