// See guard.h.
#include "server/http/guard.h"

#include <algorithm>
#include <arpa/inet.h>
#include <array>
#include <cmath>
#include <netinet/in.h>
#include <openssl/crypto.h>
#include <utility>

#include "server/http/problem.h"

namespace retake {
namespace {

constexpr std::string_view kCookie = "retake_token";

/// RFC 6750's b64token, all of which a cookie may hold as well.
bool is_token(std::string_view text) {
  return std::ranges::all_of(text, [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
           std::string_view("-._~+/=").find(c) != std::string_view::npos;
  });
}

/// An origin's or a host's authority without the port that its scheme implies.
std::string_view without_default_port(std::string_view authority, bool is_https) {
  const std::string_view port = is_https ? ":443" : ":80";
  if (authority.ends_with(port)) authority.remove_suffix(port.size());
  return authority;
}

/// A host as URLs hold it: a name in lower case, or an address.
bool is_plain_host(std::string_view host) {
  if (host.starts_with('[')) return host.ends_with(']') && host_name(host) == host;
  return !host.empty() && std::ranges::all_of(host, [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || c == '.' || c == '-' || c == '_';
  });
}

bool is_port(std::string_view text) {
  return !text.empty() && text.size() <= 5 && text.front() != '0' &&
         std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; }) &&
         std::stoi(std::string(text)) <= 65535;
}

bool is_origin(std::string_view text) {
  const std::size_t end = text.find("://");
  if (end == std::string_view::npos) return false;
  const std::string_view scheme = text.substr(0, end);
  const bool is_scheme =
      !scheme.empty() && scheme.front() >= 'a' && scheme.front() <= 'z' &&
      std::ranges::all_of(scheme, [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '+' || c == '-' || c == '.';
      });
  const std::string_view authority = text.substr(end + 3);
  const std::size_t bracket = authority.find(']');
  const std::size_t colon = authority.find(':', bracket == std::string_view::npos ? 0 : bracket);
  const bool has_port = colon != std::string_view::npos;
  return is_scheme && is_plain_host(authority.substr(0, colon)) &&
         (!has_port || is_port(authority.substr(colon + 1)));
}

bool is_same_origin(const std::string& origin, const std::string& host) {
  const bool is_https = origin.starts_with("https://");
  if (!is_https && !origin.starts_with("http://")) return false;
  return without_default_port(std::string_view(origin).substr(is_https ? 8 : 7), is_https) ==
         without_default_port(host, is_https);
}

std::string cookie_value(const RequestHead& head, std::string_view name) {
  const std::string cookies = head.list_field("cookie");
  for (const std::string_view piece : split(cookies, ';')) {
    const std::string_view cookie = trimmed(piece);
    const std::size_t equals = cookie.find('=');
    if (equals != std::string_view::npos && cookie.substr(0, equals) == name)
      return std::string(cookie.substr(equals + 1));
  }
  return {};
}

/// `/?token=`, by which a browser brings the token; empty if there is none.
std::string token_of_address(const RequestHead& head) {
  const auto given = head.query.find("token");
  return head.method == "GET" && head.path == "/" && given != head.query.end() ? given->second : "";
}

/// Every token that came with a request, in its address, its header or its cookie.
std::vector<std::string> given_tokens(const RequestHead& head) {
  std::vector<std::string> tokens = {token_of_address(head), cookie_value(head, kCookie)};
  if (const std::string* authorization = head.field("authorization"))
    if (lower_case(authorization->substr(0, 7)) == "bearer ")
      tokens.emplace_back(trimmed(std::string_view(*authorization).substr(7)));
  std::erase(tokens, "");
  return tokens;
}

}  // namespace

std::optional<std::string> host_name(std::string_view authority) {
  std::string_view name = authority;
  if (const std::size_t bracket = authority.find(']'); bracket != std::string_view::npos) {
    name = authority.substr(0, bracket + 1);
  } else if (std::ranges::count(authority, ':') <= 1) {
    name = authority.substr(0, authority.find(':'));
  } else {
    return std::nullopt;
  }
  const std::string_view port = authority.substr(name.size());
  if (port.size() > 6 || std::ranges::any_of(port.substr(std::min<std::size_t>(1, port.size())),
                                             [](char c) { return c < '0' || c > '9'; }))
    return std::nullopt;
  if (!port.empty() && port.front() != ':') return std::nullopt;
  if (name.empty()) return std::nullopt;
  if (name.front() != '[') return lower_case(name);

  std::array<unsigned char, sizeof(in6_addr)> address{};
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (inet_pton(AF_INET6, std::string(name.substr(1, name.size() - 2)).c_str(), address.data()) != 1 ||
      !inet_ntop(AF_INET6, address.data(), text.data(), text.size()))
    return std::nullopt;
  return "[" + std::string(text.data()) + "]";
}

std::string fault_of_origin(std::string_view origin) {
  const bool is_https = origin.starts_with("https://");
  const bool says_default_port = without_default_port(origin, is_https) != origin;
  if (is_origin(origin) && !(says_default_port && (is_https || origin.starts_with("http://")))) return {};
  return "no browser sends \"" + std::string(origin) +
         "\" as its origin; one has the form https://game.example or http://localhost:3000: scheme, host "
         "and, "
         "unless it is the scheme's own, port, in lower case and with nothing behind them";
}

std::string fault_of_host(std::string_view host) {
  const auto name = host_name(host);
  if (name && is_plain_host(*name)) return {};
  return "no client sends \"" + std::string(host) +
         "\" as its host; one has the form game.example, 192.0.2.1 or [2001:db8::1]";
}

bool is_preflight(const RequestHead& head) {
  return head.method == "OPTIONS" && head.field("origin") && head.field("access-control-request-method");
}

bool equal_in_constant_time(std::string_view a, std::string_view b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

HttpGuard::HttpGuard(const HttpSettings& settings)
    : token_(settings.token),
      most_body_bytes_(settings.most_body_bytes),
      hosts_{"localhost", "127.0.0.1", "[::1]"} {
  if (!is_token(token_))
    throw std::runtime_error("the token may contain only letters, digits and the characters - . _ ~ + / =");
  if (const auto own = host_name(
          settings.address.find(':') == std::string::npos ? settings.address : "[" + settings.address + "]"))
    hosts_.insert(*own);
  for (const std::string& host : settings.allowed_hosts) {
    if (const std::string fault = fault_of_host(host); !fault.empty()) throw std::runtime_error(fault);
    hosts_.insert(*host_name(host));
  }
  for (const std::string& origin : settings.allowed_origins) {
    if (const std::string fault = fault_of_origin(origin); !fault.empty()) throw std::runtime_error(fault);
    origins_.insert(origin);
  }
}

std::optional<HttpResponse> HttpGuard::admit(const RequestHead& head, std::string_view remote_address) {
  check_host(head);
  check_origin(head);

  const bool is_read = head.method == "GET" || head.method == "HEAD";
  const bool is_exempt = (is_read && head.path == "/healthz") || (is_preflight(head) && allowed_origin(head));
  if (!token_.empty() && !is_exempt && !carries_token(head, remote_address))
    throw HttpProblem(401, "unauthorized", "A token is required",
                      "Send the header 'Authorization: Bearer <token>' with the server's token.", {},
                      {{"WWW-Authenticate", "Bearer realm=\"retake\""}});
  // A browser's page cannot set headers on its event stream, so that `/?token=` is exchanged for a cookie.
  if (!token_.empty() && token_of_address(head) == token_) return cookie_redirect();
  check_body(head);
  return std::nullopt;
}

std::optional<std::string> HttpGuard::allowed_origin(const RequestHead& head) const {
  const std::string* origin = head.field("origin");
  if (!origin || !origins_.contains(lower_case(*origin))) return std::nullopt;
  return *origin;
}

void HttpGuard::check_host(const RequestHead& head) const {
  const auto name = host_name(head.host);
  if (!name || !hosts_.contains(*name))
    throw HttpProblem(421, "misdirected-request", "The host is unknown",
                      "This server does not answer under the name in the Host header field.");
}

/// Keeps other sites from acting, and from holding streams open, through a visitor's browser. Following a
/// link is fine.
void HttpGuard::check_origin(const RequestHead& head) const {
  if (allowed_origin(head)) return;
  const std::string* origin = head.field("origin");
  const std::string* site = head.field("sec-fetch-site");
  const std::string* mode = head.field("sec-fetch-mode");
  const bool is_safe = is_safe_method(head.method);
  const bool is_cross_site = site && lower_case(*site) == "cross-site";
  const bool is_link = is_safe && mode && lower_case(*mode) == "navigate";
  const bool is_foreign = !is_safe && origin && !is_same_origin(lower_case(*origin), head.host);
  if (is_foreign || (is_cross_site && !is_link))
    throw HttpProblem(403, "forbidden-origin", "The origin is not allowed",
                      "Requests from the pages of other sites are not accepted.");
}

void HttpGuard::check_body(const RequestHead& head) const {
  if (head.content_length > most_body_bytes_) throw body_too_large(most_body_bytes_);
  if (!head.has_body()) return;
  const std::string* field = head.field("content-type");
  const std::string_view sent = field ? std::string_view(*field) : "";
  const std::string type = lower_case(trimmed(sent.substr(0, sent.find(';'))));
  if (type != "application/json" && !(type.starts_with("application/") && type.ends_with("+json")))
    throw HttpProblem(415, "unsupported-media-type", "The body's type is not supported",
                      "Send JSON with the header 'Content-Type: application/json'.");
}

HttpResponse HttpGuard::cookie_redirect() const {
  HttpResponse redirect;
  redirect.status = 303;
  redirect.content_type.clear();
  redirect.headers = {
      {"Location", "/"},
      {"Set-Cookie", std::string(kCookie) + "=" + token_ + "; HttpOnly; SameSite=Strict; Path=/"}};
  return redirect;
}

/// Whether one of the tokens that came is the right one. Throws: HttpProblem, 429 for who has guessed too
/// often.
bool HttpGuard::carries_token(const RequestHead& head, std::string_view remote_address) {
  const std::vector<std::string> given = given_tokens(head);
  if (given.empty()) return false;
  const std::string client = client_at(remote_address);
  const auto now = TokenAttempts::Clock::now();
  if (const double seconds = attempts_.wait(client, now).count(); seconds > 0)
    throw HttpProblem(429, "too-many-tokens", "Too many wrong tokens came",
                      "Tokens of this client are looked at one a second now.", {},
                      {{"Retry-After", std::to_string(static_cast<int>(std::ceil(seconds)))}});
  bool is_right = false;
  for (const std::string& token : given)
    is_right |= equal_in_constant_time(token, token_);
  for (const std::string& token : given)
    if (!is_right) attempts_.note_wrong(client, token, now);
  return is_right;
}

}  // namespace retake
