// See representation.h.
#include "server/http/representation.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <ctime>
#include <stdexcept>
#include <utility>

#include <zlib.h>

#include "server/http/head.h"

namespace retake {
namespace {

constexpr std::size_t kSmallestCompressed =
    512;                              ///< [bytes] chosen: below it the header costs more than is won
constexpr int kGzipLevel = 5;         ///< chosen: a third of level 9's time at nearly its size
constexpr int kGzipWindow = 15 + 16;  ///< zlib's largest window, with gzip's header

bool is_compressible(std::string_view content_type) {
  const std::string type = lower_case(trimmed(content_type.substr(0, content_type.find(';'))));
  constexpr std::array others = {"application/json", "application/javascript", "application/xml",
                                 "application/x-ndjson", "image/svg+xml"};
  return type.starts_with("text/") || type.ends_with("+json") ||
         std::ranges::find(others, type) != others.end();
}

/// Date in the form of RFC 9110 (5.6.7).
std::string http_date(std::time_t now) {
  std::tm parts{};
  gmtime_r(&now, &parts);
  std::array<char, 40> text{};
  const std::size_t length = std::strftime(text.data(), text.size(), "%a, %d %b %Y %H:%M:%S GMT", &parts);
  return {text.data(), length};
}

/// Whether the answer's form depends on Accept-Encoding.
bool is_negotiable(const HttpResponse& response) {
  if (response.stream) return false;
  if (!response.content_encoding.empty()) return response.content_encoding == "gzip";
  return (response.pieces || response.body.size() >= kSmallestCompressed) &&
         is_compressible(response.content_type);
}

/// A gzip stream that takes pieces and gives pieces.
class GzipPieces {
 public:
  explicit GzipPieces(const StreamSink& sink) : sink_(sink) {
    if (deflateInit2(&stream_, kGzipLevel, Z_DEFLATED, kGzipWindow, 8, Z_DEFAULT_STRATEGY) != Z_OK)
      throw std::bad_alloc();
  }
  ~GzipPieces() { deflateEnd(&stream_); }
  GzipPieces(const GzipPieces&) = delete;
  GzipPieces& operator=(const GzipPieces&) = delete;

  bool add(std::string_view piece) { return deflated(piece, Z_NO_FLUSH); }
  bool finish() { return deflated({}, Z_FINISH); }

 private:
  bool deflated(std::string_view piece, int flush) {
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(piece.data()));
    stream_.avail_in = static_cast<uInt>(piece.size());
    do {
      std::array<char, 16 * 1024> compressed;
      stream_.next_out = reinterpret_cast<Bytef*>(compressed.data());
      stream_.avail_out = static_cast<uInt>(compressed.size());
      deflate(&stream_, flush);
      const std::size_t size = compressed.size() - stream_.avail_out;
      if (size > 0 && !sink_({compressed.data(), size})) return false;
    } while (stream_.avail_out == 0);
    return true;
  }

  const StreamSink& sink_;
  z_stream stream_{};
};

std::function<bool(const StreamSink&)> gzip_pieces(std::function<bool(const StreamSink&)> plain) {
  return [plain = std::move(plain)](const StreamSink& sink) {
    GzipPieces compressor(sink);
    return plain([&](std::string_view piece) { return compressor.add(piece); }) && compressor.finish();
  };
}

}  // namespace

void represent(const Preferences& preferences, HttpResponse& response) {
  // Choose between gzip and the plain form.
  const bool is_choice = is_negotiable(response);
  const bool was_gzip = response.content_encoding == "gzip";
  const bool be_gzip = is_choice && accepts_gzip(preferences.accept_encoding);
  if (is_choice) response.content_encoding = be_gzip ? "gzip" : "";

  // Name the form that was chosen.
  const bool is_read = preferences.method == "GET" || preferences.method == "HEAD";
  const bool is_known = !response.etag.empty() && response.status == 200 && is_read &&
                        names_etag(preferences.if_none_match, response.etag);
  if (!response.etag.empty()) {
    response.headers.emplace_back("ETag", "\"" + response.etag + (be_gzip ? "-gzip\"" : "\""));
    if (response.cache_control == "no-store") response.cache_control = "no-cache";
  }

  // Make the body.
  if (is_known) {
    response.status = 304;
    response.body.clear();
    response.pieces = nullptr;
    response.content_encoding.clear();
  } else if (response.pieces) {
    if (be_gzip) response.pieces = gzip_pieces(std::move(response.pieces));
  } else if (is_choice && be_gzip != was_gzip) {
    response.body = be_gzip ? gzip(response.body) : gunzip(response.body);
  }

  if (response.status == 204 || response.status == 304) response.content_type.clear();

  // Add the fields that every answer carries.
  if (!response.content_encoding.empty())
    response.headers.emplace_back("Content-Encoding", response.content_encoding);
  std::string vary = is_choice ? "Accept-Encoding" : "";
  if (preferences.varies_by_origin) vary += vary.empty() ? "Origin" : ", Origin";
  if (preferences.allowed_origin) {
    response.headers.emplace_back("Access-Control-Allow-Origin", *preferences.allowed_origin);
    response.headers.emplace_back("Access-Control-Expose-Headers", "ETag, Location, Retry-After");
  }
  response.headers.emplace_back("Cross-Origin-Resource-Policy",
                                preferences.allowed_origin ? "cross-origin" : "same-origin");
  if (!vary.empty()) response.headers.emplace_back("Vary", vary);
  response.headers.emplace_back("Cache-Control", response.cache_control);
  response.headers.emplace_back("Date", http_date(std::time(nullptr)));
  response.headers.emplace_back("Referrer-Policy", "no-referrer");
  response.headers.emplace_back("X-Content-Type-Options", "nosniff");
}

bool accepts_gzip(std::string_view accept_encoding) {
  double gzip_weight = -1, any_weight = -1, plain_weight = -1;
  for (const std::string_view piece : split(accept_encoding, ',')) {
    const std::size_t semicolon = piece.find(';');
    const std::string coding = lower_case(trimmed(piece.substr(0, semicolon)));
    double weight = 1;
    if (semicolon != std::string_view::npos) {
      const std::string parameter = lower_case(trimmed(piece.substr(semicolon + 1)));
      weight = parameter.starts_with("q=") ? std::strtod(parameter.c_str() + 2, nullptr) : 0;
    }
    if (coding == "gzip" || coding == "x-gzip") gzip_weight = weight;
    if (coding == "*") any_weight = weight;
    if (coding == "identity") plain_weight = weight;
  }
  if (gzip_weight < 0) gzip_weight = any_weight;
  return gzip_weight > 0 && gzip_weight >= plain_weight;
}

bool names_etag(std::string_view if_none_match, std::string_view etag) {
  if (trimmed(if_none_match) == "*") return true;
  for (const std::string_view piece : split(if_none_match, ',')) {
    std::string_view tag = trimmed(piece);
    if (tag.starts_with("W/")) tag.remove_prefix(2);
    if (tag.size() < 2 || tag.front() != '"' || tag.back() != '"') continue;
    tag = tag.substr(1, tag.size() - 2);
    if (tag.ends_with("-gzip") && tag.substr(0, tag.size() - 5) == etag) return true;
    if (tag == etag) return true;
  }
  return false;
}

std::string gzip(std::string_view plain) {
  z_stream stream{};
  if (deflateInit2(&stream, kGzipLevel, Z_DEFLATED, kGzipWindow, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::bad_alloc();
  std::string compressed(deflateBound(&stream, plain.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(plain.data()));
  stream.avail_in = static_cast<uInt>(plain.size());
  stream.next_out = reinterpret_cast<Bytef*>(compressed.data());
  stream.avail_out = static_cast<uInt>(compressed.size());
  const int result = deflate(&stream, Z_FINISH);
  compressed.resize(stream.total_out);
  deflateEnd(&stream);
  if (result != Z_STREAM_END) throw std::logic_error("a body could not be compressed");
  return compressed;
}

std::string gunzip(std::string_view compressed) {
  z_stream stream{};
  if (inflateInit2(&stream, kGzipWindow) != Z_OK) throw std::bad_alloc();
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(compressed.data()));
  stream.avail_in = static_cast<uInt>(compressed.size());
  std::string plain;
  int result = Z_OK;
  while (result == Z_OK) {
    std::array<char, 16 * 1024> piece;
    stream.next_out = reinterpret_cast<Bytef*>(piece.data());
    stream.avail_out = static_cast<uInt>(piece.size());
    result = inflate(&stream, Z_NO_FLUSH);
    plain.append(piece.data(), piece.size() - stream.avail_out);
  }
  inflateEnd(&stream);
  if (result != Z_STREAM_END) throw std::logic_error("a body that should be gzip is not");
  return plain;
}

}  // namespace retake
