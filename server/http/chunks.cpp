// See chunks.h. Sections named here are those of RFC 9112.
#include "server/http/chunks.h"

#include <algorithm>
#include <charconv>

#include "server/http/head.h"
#include "server/http/problem.h"

namespace retake {
namespace {

constexpr std::size_t kMostFraming = 4096;  ///< [bytes] chosen: extensions and trailers of a whole body
constexpr std::size_t kMostSizeDigits = 16;

[[noreturn]] void refuse_chunks(const std::string& detail) {
  throw HttpProblem(400, "bad-request", "The request is malformed", detail);
}

bool has_control(std::string_view text) {
  return std::ranges::any_of(text, [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return (byte < 0x20 && c != '\t') || byte == 0x7f;
  });
}

}  // namespace

std::size_t ChunkReader::take(std::string_view bytes, std::string& body) {
  const std::size_t given = bytes.size();
  while (!bytes.empty() && state_ != State::complete) {
    if (state_ == State::data) {
      const std::size_t count = std::min(left_, bytes.size());
      body.append(bytes.substr(0, count));
      bytes.remove_prefix(count);
      left_ -= count;
      if (left_ == 0) state_ = State::data_end;
      continue;
    }
    if (!take_line(bytes)) break;
    if (state_ == State::size_line) {
      begin_chunk();
      if (left_ > most_body_bytes_ - std::min(most_body_bytes_, body.size()))
        throw body_too_large(most_body_bytes_);
    } else if (state_ == State::data_end) {
      if (!line_.empty()) refuse_chunks("A chunk is longer than its size.");
      state_ = State::size_line;
    } else if (line_.empty()) {
      state_ = State::complete;
    }
    line_.clear();
  }
  return given - bytes.size();
}

/// Takes bytes up to the end of a line. True once it is whole; `line_` is without its CR LF then.
bool ChunkReader::take_line(std::string_view& bytes) {
  const std::size_t feed = bytes.find('\n');
  const std::size_t count = feed == std::string_view::npos ? bytes.size() : feed + 1;
  const std::size_t framing_left = kMostFraming - framing_bytes_;
  const std::size_t most = state_ == State::data_end ? 2 : kMostSizeDigits + 2 + framing_left;
  if (line_.size() + count > most)
    refuse_chunks(state_ == State::data_end ? "A chunk is longer than its size."
                                            : "The chunks carry too many extensions or trailers.");
  line_ += bytes.substr(0, count);
  bytes.remove_prefix(count);
  if (feed == std::string_view::npos) return false;
  if (!line_.ends_with("\r\n")) refuse_chunks("A line between the chunks does not end with CR LF.");
  line_.resize(line_.size() - 2);
  if (has_control(line_)) refuse_chunks("A line between the chunks has a control character.");
  if (state_ == State::trailer_line) count_framing(line_.size());
  return true;
}

void ChunkReader::count_framing(std::size_t bytes) {
  framing_bytes_ += bytes;
  if (framing_bytes_ > kMostFraming) refuse_chunks("The chunks carry too many extensions or trailers.");
}

/// Section 7.1: chunk-size [ ";" extension ].
void ChunkReader::begin_chunk() {
  const std::size_t digits = std::min(line_.find_first_not_of("0123456789abcdefABCDEF"), line_.size());
  const std::string_view rest = trimmed(std::string_view(line_).substr(digits));
  if (digits == 0 || digits > kMostSizeDigits || (!rest.empty() && rest.front() != ';') ||
      (rest.empty() && digits < line_.size()))
    refuse_chunks("A chunk does not begin with its size in hexadecimal digits.");
  count_framing(line_.size() - digits);
  std::from_chars(line_.data(), line_.data() + digits, left_, 16);
  state_ = left_ == 0 ? State::trailer_line : State::data;
}

}  // namespace retake
