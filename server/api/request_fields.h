// RequestFields: reads the fields of a JSON body or a query, gathering every fault before it refuses.
// It must not know what the fields are for.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "server/http/message.h"
#include "worlds/document.h"

namespace retake {

/// Fields of an object of a request's body. Read every field, then call finish().
class BodyFields {
 public:
  /// An empty body stands for {}. Throws: InvalidRequest if it is not a JSON object.
  static BodyFields parse(std::string_view body);

  /// Each gives nothing for a field that is absent or wrong.
  std::optional<std::uint64_t> integer(std::string_view name, std::uint64_t low, std::uint64_t high);
  std::optional<double> number_above(std::string_view name, double low);
  std::optional<std::string> text(std::string_view name, std::size_t longest);
  /// A text that is one of `choices`.
  std::optional<std::string> choice(std::string_view name, const std::vector<std::string>& choices);
  /// The fields of a nested object; finish() of the outer one covers it.
  BodyFields object(std::string_view name);

  /// Adds a fault at a field.
  void refuse(std::string_view name, std::string detail);
  /// Refuses unknown fields. Throws: InvalidRequest with every fault so far.
  void finish();

 private:
  struct Shared {
    nlohmann::json document;
    std::vector<Fault> faults;
    std::map<std::string, std::vector<std::string>> known;  // by the object's pointer
  };
  BodyFields(std::shared_ptr<Shared> shared, const nlohmann::json* object, std::string pointer);
  const nlohmann::json* find(std::string_view name);

  std::shared_ptr<Shared> shared_;
  const nlohmann::json* object_;  // null: absent or wrong
  std::string pointer_;
};

/// Parameters of a request's query. Read every parameter, then call finish().
class QueryFields {
 public:
  explicit QueryFields(const HttpRequest& request) : query_(request.query) {}
  std::uint64_t integer(const std::string& name, std::uint64_t low, std::uint64_t high,
                        std::uint64_t fallback);
  std::string text(const std::string& name, std::string fallback);
  void refuse(const std::string& name, const std::string& detail);
  /// Refuses unknown parameters. Throws: HttpProblem (400) with every fault so far.
  void finish();

 private:
  const std::map<std::string, std::string>& query_;
  std::vector<std::string> known_;
  std::vector<Fault> faults_;
};

}  // namespace retake
