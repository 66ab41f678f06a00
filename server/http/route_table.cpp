// See route_table.h.
#include "server/http/route_table.h"

#include <algorithm>
#include <set>
#include <utility>

#include "sampler/check.h"

namespace retake {
namespace {

/// "/a/b/" gives {"a", "b", ""}: a slash at the end is a different path.
std::vector<std::string> segments_of(std::string_view path) {
  std::vector<std::string> segments;
  path.remove_prefix(std::min<std::size_t>(1, path.size()));
  while (true) {
    const std::size_t slash = path.find('/');
    segments.emplace_back(path.substr(0, slash));
    if (slash == std::string_view::npos) return segments;
    path.remove_prefix(slash + 1);
  }
}

bool is_name(const std::string& segment) {
  return segment.starts_with('{') && segment.ends_with('}');
}

bool matches(const std::vector<std::string>& pattern, const std::vector<std::string>& path) {
  return std::ranges::equal(pattern, path, [](const std::string& expected, const std::string& segment) {
    return is_name(expected) ? !segment.empty() : expected == segment;
  });
}

/// Literal segments first; then any fixed order.
bool comes_before(const std::vector<std::string>& a, const std::vector<std::string>& b) {
  return std::ranges::lexicographical_compare(a, b, [](const std::string& left, const std::string& right) {
    return std::pair(is_name(left), left) < std::pair(is_name(right), right);
  });
}

}  // namespace

void RouteTable::add(std::string_view method, std::string_view pattern, HttpHandler handler) {
  CHECK(pattern.starts_with('/'), pattern);
  Route route{std::string(method), segments_of(pattern), std::move(handler)};
  for (const Route& other : routes_)
    CHECK(other.method != route.method || other.segments != route.segments, method, pattern);
  const auto place = std::ranges::upper_bound(routes_, route.segments, comes_before, &Route::segments);
  routes_.insert(place, std::move(route));
}

std::vector<std::pair<std::string, std::string>> RouteTable::list() const {
  std::vector<std::pair<std::string, std::string>> all;
  for (const Route& route : routes_) {
    auto& [method, pattern] = all.emplace_back(route.method, "");
    for (const std::string& segment : route.segments)
      pattern += "/" + segment;
  }
  return all;
}

RouteTable::Match RouteTable::match(std::string_view method, std::string_view path) const {
  const std::vector<std::string> segments = segments_of(path);
  const std::string_view wanted = method == "HEAD" ? "GET" : method;
  Match result;
  std::set<std::string> allowed;
  for (const Route& route : routes_) {
    if (!matches(route.segments, segments)) continue;
    allowed.insert(route.method);
    if (result.handler || route.method != wanted) continue;
    result.handler = &route.handler;
    for (std::size_t i = 0; i < segments.size(); ++i)
      if (is_name(route.segments[i]))
        result.path_values.emplace(route.segments[i].substr(1, route.segments[i].size() - 2), segments[i]);
  }
  if (allowed.empty()) return result;
  if (allowed.contains("GET")) allowed.insert("HEAD");
  allowed.insert("OPTIONS");
  for (const std::string& name : allowed)
    result.allowed_methods += (result.allowed_methods.empty() ? "" : ", ") + name;
  return result;
}

}  // namespace retake
