// RequestHead: the head of an HTTP/1.1 request, read strictly.
// Realises doc/http.md: what could be understood in two ways (smuggling) is refused, never repaired.
// It must not know sockets, routes or who may ask; that is the guard's part.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace retake {

struct HeadLimits {
  std::size_t most_path_bytes = 512;
  std::size_t most_query_bytes = 2048;  ///< chosen: cursors and filters are far shorter
  std::size_t most_fields = 100;        ///< chosen: browsers send about twenty
};

struct RequestHead {
  std::string method;
  std::string path;                                         ///< decoded, without the query; "*" of OPTIONS
  std::map<std::string, std::string> query;                 ///< decoded
  std::string host;                                         ///< lower case, with the port if one was sent
  std::vector<std::pair<std::string, std::string>> fields;  ///< names in lower case, in the order sent
  std::size_t content_length = 0;
  bool is_chunked = false;        ///< the body's length is known at its end
  bool keeps_alive = true;        ///< the client can send a further request on this connection
  bool is_http_1_0 = false;       ///< chunked answers are not understood
  bool expects_continue = false;  ///< the client waits for "100 Continue" before it sends the body

  /// The field's last value, nullptr if absent. `name` in lower case.
  const std::string* field(std::string_view name) const;
  bool has_body() const { return is_chunked || content_length > 0; }
  /// All values of a list field, joined by commas.
  std::string list_field(std::string_view name) const;
};

/// Reads a head that ends with its empty line. Throws: HttpProblem with 400, 414, 415, 416, 417, 431, 501 or
/// 505; after any of them the connection cannot be used further.
RequestHead parse_request_head(std::string_view text, const HeadLimits& limits);

bool is_safe_method(std::string_view method);  ///< GET, HEAD, OPTIONS

std::string lower_case(std::string_view text);
std::string_view trimmed(std::string_view text);  ///< without spaces and tabs at its ends
/// The pieces between separators, without those that are empty.
std::vector<std::string_view> split(std::string_view text, char separator);

}  // namespace retake
