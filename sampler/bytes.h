// ByteWriter and ByteReader: numbers to bytes and back, little-endian, for checkpoints and recorded
// animations. It must not know what the numbers mean.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

namespace retake {

static_assert(std::endian::native == std::endian::little, "stored formats are little-endian");

class ByteWriter {
 public:
  template <typename Number>
  void put(Number value) {
    static_assert(std::is_arithmetic_v<Number>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void put_numbers(const double* values, std::size_t count) {
    put(static_cast<std::uint32_t>(count));
    if (count > 0) bytes_.append(reinterpret_cast<const char*>(values), count * sizeof(double));
  }
  void put_text(std::string_view text) {
    put(static_cast<std::uint32_t>(text.size()));
    bytes_.append(text);
  }
  /// Small signed integers in few bytes: zigzag, then seven bits a byte.
  void put_varint(std::int64_t value) {
    auto rest = (static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63);
    if (rest < 0x80) {
      bytes_.push_back(static_cast<char>(rest));
      return;
    }
    char digits[10];
    std::size_t count = 0;
    for (; rest >= 0x80; rest >>= 7)
      digits[count++] = static_cast<char>(rest | 0x80);
    digits[count++] = static_cast<char>(rest);
    bytes_.append(digits, count);
  }
  void put_raw(std::string_view bytes) { bytes_.append(bytes); }
  const std::string& bytes() const { return bytes_; }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

/// Throws: std::out_of_range when the bytes end too soon.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}
  template <typename Number>
  Number get() {
    static_assert(std::is_arithmetic_v<Number>);
    Number value;
    std::memcpy(&value, take(sizeof value).data(), sizeof value);
    return value;
  }
  template <typename Vector>
  void get_numbers(Vector& values) {
    const auto count = get<std::uint32_t>();
    const std::string_view bytes = take(std::size_t{count} * sizeof(double));
    values.resize(static_cast<decltype(values.size())>(count));
    if (count > 0) std::memcpy(values.data(), bytes.data(), bytes.size());
  }
  std::string get_text() { return std::string(take(get<std::uint32_t>())); }
  std::int64_t get_varint() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      const auto byte = static_cast<unsigned char>(take(1)[0]);
      value |= static_cast<std::uint64_t>(byte & 0x7f) << shift;
      if ((byte & 0x80) == 0)
        return static_cast<std::int64_t>(value >> 1) ^ -static_cast<std::int64_t>(value & 1);
    }
    throw std::out_of_range("a number has too many bytes");
  }
  bool at_end() const { return rest_.empty(); }
  std::size_t remaining() const { return rest_.size(); }

 private:
  std::string_view take(std::size_t count) {
    if (count > rest_.size()) throw std::out_of_range("the bytes end too soon");
    const std::string_view taken = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return taken;
  }
  std::string_view rest_;
};

}  // namespace retake
