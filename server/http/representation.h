// How a response is represented to one client: not modified, compressed, with the fields that every answer
// carries. Realises doc/api.md, "Conventions": ETag and 304, gzip where the client accepts it. It must not
// know sockets or routes.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/http/message.h"

namespace retake {

/// What a client asked of the representation.
struct Preferences {
  std::string method;
  std::string if_none_match;                  ///< the field's value, empty if absent
  std::string accept_encoding;                ///< the field's value, empty if absent
  std::optional<std::string> allowed_origin;  ///< the Origin, if it may read answers
  bool varies_by_origin = false;              ///< some origins may, so that caches must tell them apart
};

/// Turns a handler's response into the one that is sent: 304 if the client has it, compressed if that is
/// accepted, with validators, caching and security fields. Its etag and cache_control are moved into the
/// headers.
void represent(const Preferences& preferences, HttpResponse& response);

/// True if an Accept-Encoding value lets gzip be used and does not prefer the plain form.
bool accepts_gzip(std::string_view accept_encoding);
/// True if an If-None-Match value names `etag` (without quotes), plain or with "-gzip", or is "*".
bool names_etag(std::string_view if_none_match, std::string_view etag);

std::string gzip(std::string_view plain);
/// Throws: std::logic_error if it is not gzip.
std::string gunzip(std::string_view compressed);

}  // namespace retake
