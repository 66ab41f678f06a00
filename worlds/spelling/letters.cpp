// See letters.h.
#include "worlds/spelling/letters.h"

#include <algorithm>
#include <array>
#include <span>

#include "sampler/check.h"

namespace retake::spelling {
namespace {

constexpr int kGap = 1;  // columns between two characters

/// A character of a face, drawn row by row. A space has empty columns.
template <std::size_t Rows>
struct Glyph {
  char character;
  std::array<std::string_view, Rows> rows;
};

// The face of five rows. A, C and M are those of figure 8.
constexpr std::array kTallFace = std::to_array<Glyph<5>>({
    {' ', {"..", "..", "..", "..", ".."}},
    {'A', {".#.", "#.#", "###", "#.#", "#.#"}},
    {'B', {"##.", "#.#", "##.", "#.#", "##."}},
    {'C', {".##", "#..", "#..", "#..", ".##"}},
    {'D', {"##.", "#.#", "#.#", "#.#", "##."}},
    {'E', {"###", "#..", "##.", "#..", "###"}},
    {'F', {"###", "#..", "##.", "#..", "#.."}},
    {'G', {".##", "#..", "#.#", "#.#", ".##"}},
    {'H', {"#.#", "#.#", "###", "#.#", "#.#"}},
    {'I', {"###", ".#.", ".#.", ".#.", "###"}},
    {'J', {"..#", "..#", "..#", "#.#", ".#."}},
    {'K', {"#.#", "#.#", "##.", "#.#", "#.#"}},
    {'L', {"#..", "#..", "#..", "#..", "###"}},
    {'M', {"#...#", "##.##", "#.#.#", "#...#", "#...#"}},
    {'N', {"#..#", "##.#", "#.##", "#..#", "#..#"}},
    {'O', {".#.", "#.#", "#.#", "#.#", ".#."}},
    {'P', {"##.", "#.#", "##.", "#..", "#.."}},
    {'Q', {".#.", "#.#", "#.#", "##.", ".##"}},
    {'R', {"##.", "#.#", "##.", "#.#", "#.#"}},
    {'S', {".##", "#..", ".#.", "..#", "##."}},
    {'T', {"###", ".#.", ".#.", ".#.", ".#."}},
    {'U', {"#.#", "#.#", "#.#", "#.#", "###"}},
    {'V', {"#.#", "#.#", "#.#", "#.#", ".#."}},
    {'W', {"#...#", "#...#", "#.#.#", "##.##", "#...#"}},
    {'X', {"#.#", "#.#", ".#.", "#.#", "#.#"}},
    {'Y', {"#.#", "#.#", ".#.", ".#.", ".#."}},
    {'Z', {"###", "..#", ".#.", "#..", "###"}},
    {'0', {"###", "#.#", "#.#", "#.#", "###"}},
    {'1', {".#.", "##.", ".#.", ".#.", "###"}},
    {'2', {"##.", "..#", ".#.", "#..", "###"}},
    {'3', {"##.", "..#", ".#.", "..#", "##."}},
    {'4', {"#.#", "#.#", "###", "..#", "..#"}},
    {'5', {"###", "#..", "##.", "..#", "##."}},
    {'6', {".##", "#..", "###", "#.#", "###"}},
    {'7', {"###", "..#", "..#", ".#.", ".#."}},
    {'8', {"###", "#.#", "###", "#.#", "###"}},
    {'9', {"###", "#.#", "###", "..#", "##."}},
    {'.', {".", ".", ".", ".", "#"}},
    {',', {"..", "..", "..", ".#", "#."}},
    {'!', {"#", "#", "#", ".", "#"}},
    {'?', {"##.", "..#", ".#.", "...", ".#."}},
    {'-', {"...", "...", "###", "...", "..."}},
    {'+', {"...", ".#.", "###", ".#.", "..."}},
    {':', {".", "#", ".", "#", "."}},
    {'\'', {"#", "#", ".", ".", "."}},
    {'"', {"#.#", "#.#", "...", "...", "..."}},
    {'/', {"..#", "..#", ".#.", "#..", "#.."}},
    {'&', {".#..", "#.#.", ".#.#", "#.#.", ".#.#"}},
    {'#', {".#.#.", "#####", ".#.#.", "#####", ".#.#."}},
    {'*', {"...", "#.#", ".#.", "#.#", "..."}},
    {'(', {".#", "#.", "#.", "#.", ".#"}},
    {')', {"#.", ".#", ".#", ".#", "#."}},
    {'=', {"...", "###", "...", "###", "..."}},
});

// The face of three rows. H and I are those of figure 5. In three rows digits cannot be told from letters.
constexpr std::array kLowFace = std::to_array<Glyph<3>>({
    {' ', {"..", "..", ".."}},       {'A', {".#.", "###", "#.#"}},
    {'B', {"##.", "###", "###"}},    {'C', {".##", "#..", ".##"}},
    {'D', {"##.", "#.#", "##."}},    {'E', {"###", "##.", "###"}},
    {'F', {"###", "##.", "#.."}},    {'G', {"##.", "#.#", ".##"}},
    {'H', {"#.#", "###", "#.#"}},    {'I', {"#", "#", "#"}},
    {'J', {"..#", "#.#", ".#."}},    {'K', {"#.#", "##.", "#.#"}},
    {'L', {"#.", "#.", "##"}},       {'M', {"##.##", "#.#.#", "#...#"}},
    {'N', {"#..#", "##.#", "#.##"}}, {'O', {".#.", "#.#", ".#."}},
    {'P', {"###", "###", "#.."}},    {'Q', {".#.", "#.#", ".##"}},
    {'R', {"##.", "##.", "#.#"}},    {'S', {".##", ".#.", "##."}},
    {'T', {"###", ".#.", ".#."}},    {'U', {"#.#", "#.#", "###"}},
    {'V', {"#.#", "#.#", ".#."}},    {'W', {"#...#", "#.#.#", "##.##"}},
    {'X', {"#.#", ".#.", "#.#"}},    {'Y', {"#.#", ".#.", ".#."}},
    {'Z', {"##.", ".#.", ".##"}},    {'.', {".", ".", "#"}},
    {'-', {"...", "###", "..."}},    {'+', {".#.", "###", ".#."}},
    {':', {"#", ".", "#"}},          {'\'', {"#", ".", "."}},
    {'/', {"..#", ".#.", "#.."}},    {'=', {"###", "...", "###"}},
});

template <typename Face>
constexpr bool has_even_rows(const Face& face) {
  for (const auto& glyph : face)
    for (const std::string_view row : glyph.rows)
      if (row.empty() || row.size() != glyph.rows[0].size()) return false;
  return true;
}
static_assert(has_even_rows(kTallFace) && has_even_rows(kLowFace));

template <std::size_t Rows>
const Glyph<Rows>* find(std::span<const Glyph<Rows>> face, char character) {
  const auto found = std::find_if(face.begin(), face.end(),
                                  [&](const Glyph<Rows>& glyph) { return glyph.character == character; });
  return found == face.end() ? nullptr : &*found;
}

/// A text set in a face, one line for each row; none if the face lacks a character of it.
template <std::size_t Rows>
std::optional<std::vector<std::string>> set_in(std::span<const Glyph<Rows>> face, std::string_view text) {
  std::vector<std::string> lines(Rows);
  for (const char character : in_capitals(text)) {
    const Glyph<Rows>* glyph = find(face, character);
    if (!glyph) return std::nullopt;
    for (std::size_t row = 0; row < Rows; ++row) {
      if (!lines[row].empty()) lines[row].append(kGap, '.');
      lines[row] += glyph->rows[row];
    }
  }
  return lines;
}

/// A text in every face that has its characters, the taller face first.
std::vector<std::vector<std::string>> settings(std::string_view text) {
  std::vector<std::vector<std::string>> all;
  if (auto tall = set_in<5>(kTallFace, text)) all.push_back(std::move(*tall));
  if (auto low = set_in<3>(kLowFace, text)) all.push_back(std::move(*low));
  CHECK(!all.empty(), text);
  return all;
}

int width(const std::vector<std::string>& lines) {
  return static_cast<int>(lines.front().size());
}
int height(const std::vector<std::string>& lines) {
  return static_cast<int>(lines.size());
}

}  // namespace

int BinPattern::count() const {
  return static_cast<int>(std::count(designated.begin(), designated.end(), true));
}

std::vector<std::string> BinPattern::lines() const {
  std::vector<std::string> all;
  for (int row = 0; row < rows; ++row) {
    std::string& line = all.emplace_back();
    for (int column = 0; column < columns; ++column)
      line += designated[index(column, row)] ? '#' : '.';
  }
  return all;
}

BinPattern pattern_of(const std::vector<std::string>& lines) {
  CHECK(!lines.empty());
  BinPattern pattern{.columns = width(lines), .rows = height(lines)};
  for (const std::string& line : lines) {
    CHECK(line.size() == lines.front().size(), line);
    for (const char mark : line) {
      CHECK(mark == '#' || mark == '.', line);
      pattern.designated.push_back(mark == '#');
    }
  }
  return pattern;
}

std::string in_capitals(std::string_view text) {
  std::string capitals(text);
  for (char& character : capitals)
    if (character >= 'a' && character <= 'z') character = static_cast<char>(character - 'a' + 'A');
  return capitals;
}

std::vector<std::string> unknown_characters(std::string_view text) {
  std::vector<std::string> unknown;
  for (std::size_t at = 0; at < text.size();) {
    // A UTF-8 character is a first byte and the bytes 10xxxxxx that follow.
    std::size_t end = at + 1;
    while (end < text.size() && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80)
      ++end;
    std::string character = in_capitals(text.substr(at, end - at));
    at = end;
    if (character.size() == 1 && find<5>(kTallFace, character[0])) continue;
    if (std::find(unknown.begin(), unknown.end(), character) == unknown.end())
      unknown.push_back(std::move(character));
  }
  return unknown;
}

TextSize least_size(std::string_view text) {
  const std::vector<std::string> lowest = settings(text).back();
  return {.columns = width(lowest), .rows = height(lowest)};
}

std::optional<TextSize> room_for(std::string_view text, int most_columns) {
  for (const std::vector<std::string>& lines : settings(text))
    if (width(lines) <= most_columns)
      return TextSize{.columns = std::min(width(lines) + 2, most_columns), .rows = height(lines) + 2};
  return std::nullopt;
}

std::optional<BinPattern> lay_out(std::string_view text, int columns, int rows) {
  const auto all = settings(text);
  const auto fits = [&](int margin) {
    return std::find_if(all.begin(), all.end(), [&](const std::vector<std::string>& lines) {
      return width(lines) <= columns && height(lines) + 2 * margin <= rows;
    });
  };
  auto chosen = fits(1);
  if (chosen == all.end()) chosen = fits(0);
  if (chosen == all.end()) return std::nullopt;

  BinPattern pattern{.columns = columns, .rows = rows};
  pattern.designated.assign(static_cast<std::size_t>(columns * rows), false);
  const int left = (columns - width(*chosen)) / 2, top = (rows - height(*chosen)) / 2;
  for (int row = 0; row < height(*chosen); ++row)
    for (int column = 0; column < width(*chosen); ++column)
      if ((*chosen)[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)] == '#')
        pattern.designated[pattern.index(left + column, top + row)] = true;
  return pattern;
}

}  // namespace retake::spelling
