// RouteTable: which handler answers a method and a path.
// Realises doc/api.md: 404 for unknown paths, 405 with Allow for known ones. Matches segments, never regular
// expressions. It must not know sockets.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/http/message.h"

namespace retake {

class RouteTable {
 public:
  /// Requires: a pattern that begins with '/', not added before for this method.
  void add(std::string_view method, std::string_view pattern, HttpHandler handler);

  /// Method and pattern of every route.
  std::vector<std::pair<std::string, std::string>> list() const;

  struct Match {
    const HttpHandler* handler = nullptr;  ///< nullptr if the path is unknown or does not know the method
    std::map<std::string, std::string> path_values;
    std::string allowed_methods;  ///< as for the Allow field; empty if the path is unknown
  };
  /// `path` decoded. HEAD is answered by a GET route.
  Match match(std::string_view method, std::string_view path) const;

 private:
  struct Route {
    std::string method;
    std::vector<std::string> segments;  ///< "{name}" matches one segment that is not empty
    HttpHandler handler;
  };
  std::vector<Route>
      routes_;  ///< literal segments before {name} ones, so that the first match is the closest
};

}  // namespace retake
