// Cursors as hexadecimal: listing, scenario, row and log_target, closed by a checksum.
// The checksum tells a mangled cursor from a good one; it is no secret.
#include "db/sqlite/cursor.h"

#include <bit>
#include <cmath>
#include <cstddef>

#include "db/errors.h"

namespace retake::database {
namespace {

constexpr std::string_view kDigits = "0123456789abcdef";

void append_hexadecimal(std::string& text, std::uint64_t value) {
  for (int shift = 60; shift >= 0; shift -= 4)
    text += kDigits[(value >> shift) & 0xf];
}

std::uint64_t read_hexadecimal(std::string_view digits) {
  std::uint64_t value = 0;
  for (const char digit : digits) {
    const auto place = kDigits.find(digit);
    if (place == std::string_view::npos) throw BadCursor("not a cursor of this store");
    value = value << 4 | place;
  }
  return value;
}

// FNV-1a.
std::uint64_t checksum(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char letter : text)
    hash = (hash ^ static_cast<unsigned char>(letter)) * 0x100000001b3u;
  return hash;
}

}  // namespace

std::string encode(const Cursor& cursor) {
  std::string text(1, static_cast<char>(cursor.listing));
  append_hexadecimal(text, static_cast<std::uint64_t>(cursor.scenario));
  append_hexadecimal(text, static_cast<std::uint64_t>(cursor.row));
  append_hexadecimal(text, std::bit_cast<std::uint64_t>(cursor.log_target));
  append_hexadecimal(text, checksum(text));
  return text;
}

Cursor decode_cursor(std::string_view text, Listing listing, std::int64_t scenario) {
  constexpr std::size_t digits = 16;
  constexpr std::size_t length = 1 + 4 * digits;
  if (text.size() != length) throw BadCursor("not a cursor of this store");
  const auto field = [&](std::size_t index) {
    return read_hexadecimal(text.substr(1 + index * digits, digits));
  };
  if (field(3) != checksum(text.substr(0, length - digits))) throw BadCursor("not a cursor of this store");

  const Cursor cursor{static_cast<Listing>(text[0]), static_cast<std::int64_t>(field(0)),
                      static_cast<std::int64_t>(field(1)), std::bit_cast<double>(field(2))};
  if (cursor.listing != listing || cursor.scenario != scenario || std::isnan(cursor.log_target)) {
    throw BadCursor("the cursor belongs to another listing");
  }
  return cursor;
}

}  // namespace retake::database
