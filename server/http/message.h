// HttpRequest and HttpResponse: what a handler gets and gives.
// doc/http.md. They must not know sockets, JSON or routes.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace retake {

struct HttpRequest {
  std::string method;
  std::string path;                                ///< decoded, without the query
  std::map<std::string, std::string> path_values;  ///< {name} parts of the route, decoded
  std::map<std::string, std::string> query;        ///< decoded; a repeated parameter is refused before
  std::map<std::string, std::string> headers;      ///< names in lower case; a repeated header's last value
  std::string body;
  std::string remote_address;
};

/// Writes one piece of a stream to the client; false once the client is gone or the server stops.
using StreamSink = std::function<bool(std::string_view)>;

struct HttpResponse {
  int status = 200;
  std::string content_type = "application/json";
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers;
  std::string etag;  ///< strong entity tag without quotes; a matching If-None-Match gives 304
  std::string cache_control = "no-store";  ///< with an etag and nothing else said: "no-cache"
  std::string content_encoding;            ///< of a body that is compressed already ("gzip"); sent as it is
  /// Set for a body that is too large to be held, in place of `body`: called on the connection's thread to
  /// write it piece by piece, the same each time. False if the sink wanted no more.
  std::function<bool(const StreamSink&)> pieces;
  /// Set for a stream (server-sent events): called on the connection's thread until it returns.
  /// Such connections are counted against HttpSettings::most_streams.
  std::function<void(const StreamSink&)> stream;
};

using HttpHandler = std::function<HttpResponse(const HttpRequest&)>;

}  // namespace retake
