// Document: reading JSON that a client sent, refusing what is wrong with every fault's JSON Pointer.
// doc/design.md, section 6 and doc/api.md, "Conventions". Knows nothing of HTTP.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace retake {

/// One thing that is wrong with a document.
struct Fault {
  std::string pointer;  ///< JSON Pointer (RFC 6901) of the place, "" for the whole document
  std::string detail;   ///< a sentence for the caller
};

/// The caller is wrong. Carries every fault at once.
class InvalidRequest : public std::runtime_error {
 public:
  /// Requires: at least one fault.
  explicit InvalidRequest(std::vector<Fault> faults, bool malformed = false);
  const std::vector<Fault>& faults() const { return faults_; }
  /// True if the text is not JSON at all, so that its meaning could not be judged (400 rather than 422).
  bool malformed() const { return malformed_; }

 private:
  std::vector<Fault> faults_;
  bool malformed_;
};

inline constexpr int kDeepestDocument = 32;  ///< levels of nesting

/// Parses JSON text. Throws: InvalidRequest for malformed text, for documents nested deeper than
/// kDeepestDocument, for duplicate keys, for numbers that overflow to infinity and for strings that are not
/// UTF-8.
nlohmann::json parse_document(std::string_view text);

/// `pointer` with one more reference token, escaped as RFC 6901 asks.
std::string append_pointer(std::string_view pointer, std::string_view token);
std::string append_pointer(std::string_view pointer, std::size_t index);

}  // namespace retake
