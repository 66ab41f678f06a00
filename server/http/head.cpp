// See head.h. Sections named here are those of RFC 9112 unless said otherwise.
#include "server/http/head.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>

#include "server/http/problem.h"

namespace retake {
namespace {

constexpr std::size_t kLargestLength = std::size_t{1}
                                       << 62;  ///< [bytes] chosen: no number near overflow goes on

[[noreturn]] void refuse(std::string detail) {
  throw HttpProblem(400, "bad-request", "The request is malformed", std::move(detail));
}

bool is_token_character(char c) {
  constexpr std::string_view marks = "!#$%&'*+-.^_`|~";
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
         marks.find(c) != std::string_view::npos;
}

bool is_control(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte < 0x20 || byte == 0x7f;
}

std::optional<int> hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return std::nullopt;
}

/// True if `text` is UTF-8 without overlong forms and surrogates.
bool is_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i]);
    const std::size_t length = lead < 0x80 ? 1 : lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
    if ((lead >= 0x80 && lead < 0xc2) || lead > 0xf4 || i + length > text.size()) return false;
    for (std::size_t k = 1; k < length; ++k) {
      const auto next = static_cast<unsigned char>(text[i + k]);
      if ((next & 0xc0) != 0x80) return false;
      if (k == 1 && ((lead == 0xe0 && next < 0xa0) || (lead == 0xed && next > 0x9f) ||
                     (lead == 0xf0 && next < 0x90) || (lead == 0xf4 && next > 0x8f)))
        return false;
    }
    i += length;
  }
  return true;
}

/// Percent-decoding. `plus_is_space` as in the query of a form.
std::string decoded(std::string_view text, bool plus_is_space, std::string_view what) {
  std::string plain;
  plain.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '%') {
      const auto high = i + 2 < text.size() ? hex_digit(text[i + 1]) : std::nullopt;
      const auto low = i + 2 < text.size() ? hex_digit(text[i + 2]) : std::nullopt;
      if (!high || !low)
        refuse("The " + std::string(what) + " has a '%' that two hexadecimal digits do not follow.");
      c = static_cast<char>(*high * 16 + *low);
      i += 2;
      if (c == '/' && !plus_is_space) refuse("The path has an encoded slash.");
    } else if (c == '+' && plus_is_space) {
      c = ' ';
    }
    if (is_control(c)) refuse("The " + std::string(what) + " has a control character.");
    plain += c;
  }
  if (!is_utf8(plain)) refuse("The " + std::string(what) + " is not UTF-8.");
  return plain;
}

std::map<std::string, std::string> parse_query(std::string_view text) {
  std::map<std::string, std::string> query;
  for (const std::string_view piece : split(text, '&')) {
    const std::size_t equals = piece.find('=');
    std::string name = decoded(piece.substr(0, equals), true, "query");
    std::string value =
        equals == std::string_view::npos ? "" : decoded(piece.substr(equals + 1), true, "query");
    if (!query.emplace(std::move(name), std::move(value)).second)
      throw HttpProblem(400, "repeated-parameter", "A query parameter is repeated",
                        "Each query parameter may be given once.");
  }
  return query;
}

/// Section 3.2: origin form, absolute form and the asterisk. The authority of an absolute form replaces Host.
void parse_target(std::string_view target, const HeadLimits& limits, RequestHead& head) {
  if (target == "*" && head.method == "OPTIONS") {
    head.path = "*";
    return;
  }
  const std::string start = lower_case(target.substr(0, 8));
  const std::size_t scheme = start == "https://" ? 8 : start.starts_with("http://") ? 7 : 0;
  if (scheme > 0) {
    target.remove_prefix(scheme);
    const std::size_t end = std::min(target.find_first_of("/?"), target.size());
    head.host = lower_case(target.substr(0, end));
    if (head.host.empty() || head.host.front() == ':') refuse("The request target names no host.");
    target.remove_prefix(end);
  } else if (!target.starts_with('/')) {
    refuse("The request target must begin with '/'.");
  }
  const std::size_t question = target.find('?');
  const std::string_view path = target.substr(0, question);
  const std::string_view query = question == std::string_view::npos ? "" : target.substr(question + 1);
  if (path.size() > limits.most_path_bytes || query.size() > limits.most_query_bytes)
    throw HttpProblem(414, "uri-too-long", "The address is too long",
                      "A path may have " + std::to_string(limits.most_path_bytes) + " bytes, a query " +
                          std::to_string(limits.most_query_bytes) + ".");
  for (const char c : target)
    if (c == '#' || c == '\\' || static_cast<unsigned char>(c) >= 0x80)
      refuse("The request target has a character that must be encoded.");
  head.path = path.empty() ? "/" : decoded(path, false, "path");
  head.query = parse_query(query);
}

/// Section 3: method SP target SP version, with single spaces.
void parse_request_line(std::string_view line, const HeadLimits& limits, RequestHead& head) {
  const std::size_t first = line.find(' ');
  const std::size_t last = line.rfind(' ');
  if (first == std::string_view::npos || first == last)
    refuse("The request line is not 'METHOD target HTTP/1.1'.");
  const std::string_view method = line.substr(0, first);
  const std::string_view target = line.substr(first + 1, last - first - 1);
  const std::string_view version = line.substr(last + 1);
  if (!std::ranges::all_of(method, is_token_character) || method.empty())
    refuse("The method is not a token.");
  if (target.empty() || std::ranges::any_of(target, [](char c) { return c == ' ' || is_control(c); }))
    refuse("The request target has a space or a control character.");
  if (version != "HTTP/1.1" && version != "HTTP/1.0") {
    if (!version.starts_with("HTTP/")) refuse("The request line does not end with an HTTP version.");
    throw HttpProblem(505, "version-not-supported", "The HTTP version is not supported",
                      "This server speaks HTTP/1.1.");
  }
  constexpr std::array known = {"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"};
  if (std::ranges::find(known, method) == known.end())
    throw HttpProblem(501, "not-implemented", "The method is not implemented",
                      "This server knows GET, HEAD, POST, PUT, PATCH, DELETE and OPTIONS.");
  head.method = method;
  head.is_http_1_0 = version == "HTTP/1.0";
  parse_target(target, limits, head);
}

/// Section 5: name ":" OWS value OWS, no folding, no space before the colon.
std::pair<std::string, std::string> parse_field(std::string_view line) {
  if (line.front() == ' ' || line.front() == '\t') refuse("A header field is folded over several lines.");
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos || colon == 0 ||
      !std::ranges::all_of(line.substr(0, colon), is_token_character))
    refuse("A header field's name is not a token followed by a colon.");
  const std::string_view value = trimmed(line.substr(colon + 1));
  if (std::ranges::any_of(value, [](char c) { return c != '\t' && is_control(c); }))
    refuse("A header field has a control character.");
  return {lower_case(line.substr(0, colon)), std::string(value)};
}

/// Section 6.1: `chunked` alone. Whatever else stands there could be understood in two ways.
void read_transfer_encoding(const std::string& codings, RequestHead& head) {
  if (head.field("content-length")) refuse("The request has both Transfer-Encoding and Content-Length.");
  if (head.is_http_1_0) refuse("HTTP/1.0 has no Transfer-Encoding.");
  if (lower_case(codings) != "chunked")
    throw HttpProblem(501, "not-implemented", "The transfer coding is not implemented",
                      "Of transfer codings this server knows 'chunked' alone.");
  head.is_chunked = true;
}

/// Section 6: how long the body is; without a word of it there is none, whatever its type is said to be.
void read_body_length(RequestHead& head) {
  if (const std::string* codings = head.field("transfer-encoding")) read_transfer_encoding(*codings, head);
  const std::string* length = head.field("content-length");
  if (!length) return;
  const bool decimal =
      !length->empty() && std::ranges::all_of(*length, [](char c) { return c >= '0' && c <= '9'; });
  if (!decimal) refuse("Content-Length is not a decimal number.");
  const auto parsed = std::from_chars(length->data(), length->data() + length->size(), head.content_length);
  if (parsed.ec != std::errc() || head.content_length > kLargestLength)
    refuse("Content-Length is beyond every length that a body can have.");
}

void check_uniqueness(const RequestHead& head) {
  constexpr std::array unique = {"host",           "content-length",
                                 "content-type",   "content-encoding",
                                 "authorization",  "transfer-encoding",
                                 "origin",         "expect",
                                 "sec-fetch-site", "range"};
  for (const std::string_view name : unique)
    if (std::ranges::count(head.fields, name, &std::pair<std::string, std::string>::first) > 1)
      refuse("The header field " + std::string(name) + " occurs twice.");
}

/// Features that are not offered and that are costly to be wrong about.
void check_refused_features(const RequestHead& head) {
  if (head.field("content-encoding"))
    throw HttpProblem(415, "unsupported-media-type", "The body's encoding is not supported",
                      "Send the body without a Content-Encoding.");
  // One range is ignored, as RFC 9110 (14.2) allows: the whole is sent.
  const std::string* range = head.field("range");
  if (range && (range->find(',') != std::string::npos || range->size() > 64))
    throw HttpProblem(416, "range-not-satisfiable", "The ranges are not served", "Ask for the whole.");
  const std::string* expect = head.field("expect");
  if (expect && lower_case(*expect) != "100-continue")
    throw HttpProblem(417, "expectation-failed", "The expectation cannot be met",
                      "Only '100-continue' is understood.");
}

}  // namespace

bool is_safe_method(std::string_view method) {
  return method == "GET" || method == "HEAD" || method == "OPTIONS";
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return lower;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> pieces;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(separator), text.size());
    if (end > 0) pieces.push_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return pieces;
}

const std::string* RequestHead::field(std::string_view name) const {
  const auto found =
      std::find_if(fields.rbegin(), fields.rend(), [&](const auto& field) { return field.first == name; });
  return found == fields.rend() ? nullptr : &found->second;
}

std::string RequestHead::list_field(std::string_view name) const {
  std::string joined;
  for (const auto& [key, value] : fields)
    if (key == name) joined += (joined.empty() ? "" : ", ") + value;
  return joined;
}

RequestHead parse_request_head(std::string_view text, const HeadLimits& limits) {
  RequestHead head;
  bool is_first = true;
  for (std::size_t end = text.find("\r\n"); end != std::string_view::npos && end > 0;
       end = text.find("\r\n")) {
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end + 2);
    if (is_first) {
      parse_request_line(line, limits, head);
    } else if (head.fields.size() == limits.most_fields) {
      throw HttpProblem(431, "header-fields-too-large", "The header is too large",
                        "There are too many header fields.");
    } else {
      head.fields.push_back(parse_field(line));
    }
    is_first = false;
  }
  check_uniqueness(head);

  const std::string* host = head.field("host");
  if (!host) refuse("The Host header field is missing.");
  if (head.host.empty()) head.host = lower_case(*host);

  read_body_length(head);
  if (head.has_body() && is_safe_method(head.method)) refuse("A " + head.method + " request has no body.");
  check_refused_features(head);
  head.expects_continue = head.field("expect") && head.has_body() && !head.is_http_1_0;

  // Section 9.3: 1.1 stays unless it says close, 1.0 closes unless it asks to stay.
  bool says_close = false, says_keep_alive = false;
  const std::string options = lower_case(head.list_field("connection"));
  for (const std::string_view option : split(options, ',')) {
    says_close |= trimmed(option) == "close";
    says_keep_alive |= trimmed(option) == "keep-alive";
  }
  head.keeps_alive = !says_close && (!head.is_http_1_0 || says_keep_alive);
  return head;
}

}  // namespace retake
