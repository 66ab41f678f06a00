// HttpGuard: who may ask, and with what kind of body, judged from a request's head before anything is done
// for it. Realises doc/api.md, "Conventions" (Host, Origin, token, CORS) and doc/http.md. It must not know
// sockets or routes.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "server/http/clients.h"
#include "server/http/head.h"
#include "server/http/message.h"
#include "server/http/settings.h"

namespace retake {

/// Thread safety: any thread.
class HttpGuard {
 public:
  /// Throws: std::runtime_error for a token that no cookie can hold, for hosts and origins that nobody can
  /// send.
  explicit HttpGuard(const HttpSettings& settings);

  /// Lets a request pass, or answers it in place of the routes: the redirect that turns `/?token=` into a
  /// cookie. Throws: HttpProblem with 401, 403, 413, 415, 421 or 429.
  std::optional<HttpResponse> admit(const RequestHead& head, std::string_view remote_address);

  /// The request's Origin if it is allowed by name to read answers (CORS).
  std::optional<std::string> allowed_origin(const RequestHead& head) const;
  bool allows_origins() const { return !origins_.empty(); }

 private:
  void check_host(const RequestHead& head) const;
  void check_origin(const RequestHead& head) const;
  void check_body(const RequestHead& head) const;
  bool carries_token(const RequestHead& head, std::string_view remote_address);
  HttpResponse cookie_redirect() const;

  std::string token_;
  std::size_t most_body_bytes_;
  std::set<std::string> hosts_;
  std::set<std::string> origins_;
  TokenAttempts attempts_;
};

/// A Host header field's name without the port, lower case, IPv6 literals in their shortest form and in
/// brackets. std::nullopt if it is none.
std::optional<std::string> host_name(std::string_view authority);

/// Why no browser ever sends this as its Origin, and what one sends; empty if one may.
std::string fault_of_origin(std::string_view origin);
/// Why no client ever sends this as its Host; empty if one may.
std::string fault_of_host(std::string_view host);

/// True for a preflight request of CORS.
bool is_preflight(const RequestHead& head);

/// True if both are equal; takes the same time wherever they differ.
bool equal_in_constant_time(std::string_view a, std::string_view b);

}  // namespace retake
