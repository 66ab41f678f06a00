// ChunkReader: takes the chunks of a body apart, as strictly as the head is read.
// Realises doc/http.md and RFC 9112 (7.1): extensions and trailers are read past, in bounded amounts. It must
// not know sockets, nor what the body says.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace retake {

/// Thread safety: used by one thread.
class ChunkReader {
 public:
  explicit ChunkReader(std::size_t most_body_bytes) : most_body_bytes_(most_body_bytes) {}

  /// Takes bytes as they arrive, however they are cut, and appends to `body` what is of it. Returns how many
  /// it took: all of them until is_complete(). Throws: HttpProblem, 400 for what is not chunks, 413.
  std::size_t take(std::string_view bytes, std::string& body);
  /// The last chunk and the empty line behind it were taken.
  bool is_complete() const { return state_ == State::complete; }

 private:
  enum class State { size_line, data, data_end, trailer_line, complete };

  bool take_line(std::string_view& bytes);
  void begin_chunk();
  void count_framing(std::size_t bytes);

  std::size_t most_body_bytes_;
  State state_ = State::size_line;
  std::string line_;               ///< the line that is being received, with its CR LF
  std::size_t left_ = 0;           ///< [bytes] of the chunk at hand
  std::size_t framing_bytes_ = 0;  ///< of extensions and trailers so far
};

}  // namespace retake
