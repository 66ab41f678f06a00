// ApiDocument: doc/api.md as data - its routes, fields, shapes, problems, metrics and events, so that tests
// can hold the program to it. It must not know how the program answers.
#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace retake::test {

/// A field of a request's body, or a parameter of its query.
struct ApiField {
  std::string name;  ///< "stop.samples" is the field `samples` of the object `stop`
  std::string type;  ///< as it stands in the table, such as "integer from 1 to 64"
};

struct ApiRoute {
  std::string method;
  std::string path;  ///< with its {name} segments
  std::vector<ApiField> fields{};
  std::vector<ApiField> parameters{};
  std::map<int, std::string> answers{};  ///< shape by status; "" where it is not JSON
};

struct ApiDocument {
  std::vector<ApiRoute> routes;
  /// By name. A shape is a JSON object of its keys; "key?" may be absent, "*" is every other key. A value is
  /// a type, [a type] for a list, or an object. A type is "string", "integer", "number", "boolean", "object",
  /// "array", "time", "null", "any", "=one, of, these" or "@Shape", several joined by '|'.
  std::map<std::string, nlohmann::json> shapes;
  std::set<std::pair<std::string, int>> problems;  ///< type and status
  std::map<std::string, std::string> metrics;      ///< type by name
  std::map<std::string, std::string> events;       ///< shape by name
};

/// Throws: std::runtime_error naming the line that cannot be read.
ApiDocument read_api_document(const std::string& text);

/// doc/api.md of this source tree, read once.
const ApiDocument& api_document();

}  // namespace retake::test
