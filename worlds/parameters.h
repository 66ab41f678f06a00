// ParameterTable: the fields of a JSON object - their types, ranges, defaults and words - written once.
// Reading a document and publishing its JSON Schema both come from this table. It must not know any world.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "worlds/document.h"

namespace retake {

class ParameterTable;

/// One field of an object.
struct Parameter {
  enum class Kind {
    number,
    integer,
    boolean,
    choice,       ///< one of `choices`
    integer_set,  ///< a list of different integers, whose order means nothing
    text,         ///< a string of at least one byte
    text_list,    ///< a list of strings in order, each of at least one byte
    number_list,  ///< a list of numbers in order
    object,       ///< an object with the fields of a table of its own
    object_list,  ///< a list of such objects in order
  };
  std::string name{};
  Kind kind = Kind::number;
  nlohmann::json default_value{};  ///< null: the field is required
  /// Of the number, or of every member of a set or list.
  double minimum = -std::numeric_limits<double>::infinity();
  double maximum = std::numeric_limits<double>::infinity();
  bool above_minimum = false;          ///< the minimum itself is refused
  std::vector<std::string> choices{};  ///< at least one, for a choice alone
  std::size_t fewest = 0;              ///< members of a set or list
  std::size_t most = 0;                ///< members of a list; at least 1 for a list alone
  std::size_t longest = 0;             ///< bytes of a text, or of each of a list; at least 1 for these alone
  /// Of an object, or of each of a list; for these alone.
  std::shared_ptr<const ParameterTable> fields{};
  std::string unit{};  ///< "" for a pure number
  std::string summary{};
  std::string source{};  ///< where the default comes from: a section of the paper, or "chosen" and why
};

/// An object that a ParameterTable has read: every field is there and in its range.
class Parameters {
 public:
  explicit Parameters(nlohmann::json document) : document_(std::move(document)) {}
  double number(std::string_view name) const;
  std::int64_t integer(std::string_view name) const;
  bool boolean(std::string_view name) const;
  std::string choice(std::string_view name) const;
  /// In ascending order.
  std::vector<int> integer_set(std::string_view name) const;
  std::string text(std::string_view name) const;
  std::vector<std::string> text_list(std::string_view name) const;
  std::vector<double> number_list(std::string_view name) const;
  Parameters object(std::string_view name) const;
  std::vector<Parameters> object_list(std::string_view name) const;
  const nlohmann::json& document() const { return document_; }

 private:
  const nlohmann::json& field(std::string_view name) const;
  nlohmann::json document_;
};

class ParameterTable {
 public:
  /// Requires: every default is a value that reading would take; a set's members are bounded on both sides,
  /// within an int.
  explicit ParameterTable(std::vector<Parameter> parameters);

  /// Fills in the defaults and puts every set in ascending order, so that equal objects become equal
  /// documents. Appends a fault, with its JSON Pointer below `pointer`, for everything that is wrong: not an
  /// object, unknown fields, missing ones, wrong types, numbers out of range, members given twice. What a
  /// faulty field holds in the result is its default; without one its minimum, false, its first choice, the
  /// empty set, text or list, an object of such values. `ignored` names fields that the caller reads itself.
  Parameters read(const nlohmann::json& object, std::string_view pointer, std::vector<Fault>& faults,
                  const std::vector<std::string>& ignored = {}) const;

  /// JSON Schema (2020-12) of the object, with default, unit ("x-unit") and source ("x-source") of every
  /// field.
  nlohmann::json schema() const;

 private:
  std::vector<Parameter> parameters_;
};

/// A number as a person would write it, for messages.
std::string plain_number(double value);
/// "a, b, c", for messages.
std::string list_of_names(const std::vector<std::string>& names);

}  // namespace retake
