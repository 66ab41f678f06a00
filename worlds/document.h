// Document: reading JSON that a client sent, refusing what is wrong with every fault's JSON Pointer.
// doc/design.md, section 6 and doc/api.md, "Conventions". Knows nothing of HTTP.
#pragma once

#include <cstddef>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace retake {

/// One thing that is wrong with a document.
struct Fault {
  std::string pointer;    ///< JSON Pointer (RFC 6901) of the place, "" for the whole document
  std::string detail;     ///< a sentence for the caller
  std::size_t count = 1;  ///< of faults of this kind that it stands for
};

inline constexpr std::size_t kMostFaultsListed = 100;  ///< chosen: more than anybody mends at once

/// The caller is wrong. Carries the first kMostFaultsListed faults at once.
class InvalidRequest : public std::runtime_error {
 public:
  /// Requires: at least one fault.
  explicit InvalidRequest(std::vector<Fault> faults, bool malformed = false);
  const std::vector<Fault>& faults() const { return faults_; }
  /// How many there are beside those.
  std::size_t further_faults() const { return further_faults_; }
  /// True if the text is not JSON at all, so that its meaning could not be judged (400 rather than 422).
  bool malformed() const { return malformed_; }

 private:
  std::vector<Fault> faults_;
  std::size_t further_faults_ = 0;
  bool malformed_;
};

inline constexpr int kDeepestDocument = 32;  ///< levels of nesting
/// Objects, lists, strings, numbers, booleans and nulls; chosen: twice what the schemas have room for.
inline constexpr std::size_t kMostDocumentValues = 10'000;
inline constexpr std::size_t kLongestFieldName = 256;  ///< [bytes] chosen: names of fields are short
inline constexpr std::size_t kLongestText = 4096;  ///< [bytes] chosen: far above every text of the schemas

/// Parses JSON text, and stops where it becomes too much: what is built is bounded, however long the text is.
/// Throws: InvalidRequest for malformed text, for documents nested deeper than kDeepestDocument, of more than
/// kMostDocumentValues values, with keys beyond kLongestFieldName or texts beyond kLongestText, for duplicate
/// keys, for numbers that overflow to infinity and for strings that are not UTF-8.
nlohmann::json parse_document(std::string_view text);

/// Appends a fault for each field of an object that is not known: `detail`. From kMostFaultsListed on one
/// fault stands for all the rest.
void refuse_unknown_fields(const nlohmann::json& object, std::string_view pointer,
                           const std::function<bool(const std::string& name)>& is_known,
                           const std::string& detail, std::vector<Fault>& faults);

/// `pointer` with one more reference token, escaped as RFC 6901 asks.
std::string append_pointer(std::string_view pointer, std::string_view token);
std::string append_pointer(std::string_view pointer, std::size_t index);

}  // namespace retake
