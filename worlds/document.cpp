// See document.h.
#include "worlds/document.h"

#include <ranges>
#include <set>
#include <utility>

#include "sampler/check.h"

namespace retake {
namespace {

/// Builds a document from parse events and refuses what nlohmann's own parser lets pass: depth, number of
/// values, long and duplicate keys, numbers beyond a double. It keeps the pointer of the place it is at.
class StrictReader final : public nlohmann::json_sax<nlohmann::json> {
 public:
  bool null() override { return add(nullptr); }
  bool boolean(bool value) override { return add(value); }
  bool number_integer(number_integer_t value) override { return add(value); }
  bool number_unsigned(number_unsigned_t value) override { return add(value); }
  bool number_float(number_float_t value, const string_t&) override { return add(value); }
  bool string(string_t& value) override {
    if (value.size() > kLongestText)
      return refuse("a text of more than " + std::to_string(kLongestText) + " bytes");
    return add(std::move(value));
  }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return open(nlohmann::json::object()); }
  bool end_object() override { return close(); }
  bool start_array(std::size_t) override { return open(nlohmann::json::array()); }
  bool end_array() override { return close(); }
  bool key(string_t& value) override {
    if (value.size() > kLongestFieldName) return refuse_long_key();
    key_ = std::move(value);
    if (levels_.back()->contains(key_)) return refuse("the key occurs twice");
    return true;
  }
  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception& fault) override {
    if (fault.id == 406) return refuse("the number is too large for a double");
    faults.push_back(
        {"", "not JSON: the text breaks off or is malformed at byte " + std::to_string(position)});
    malformed = true;
    return false;
  }

  nlohmann::json document;
  std::vector<Fault> faults;
  bool malformed = false;

 private:
  std::string pointer() const {
    std::string text;
    for (std::size_t level = 0; level < levels_.size(); ++level)
      text = levels_[level]->is_array() ? append_pointer(text, sizes_[level])
                                        : append_pointer(text, keys_[level]);
    return text;
  }
  bool refuse(std::string detail) {
    if (!levels_.empty()) keys_.back() = key_;
    faults.push_back({pointer(), std::move(detail)});
    return false;
  }
  bool refuse_long_key() {
    const std::string place = pointer();
    faults.push_back({place.substr(0, place.rfind('/')),
                      "has a key of more than " + std::to_string(kLongestFieldName) + " bytes"});
    return false;
  }
  bool has_room() {
    if (++value_count_ <= kMostDocumentValues) return true;
    faults.push_back({"", "has more than " + std::to_string(kMostDocumentValues) +
                              " values, counted are objects, lists and what they hold"});
    return false;
  }
  nlohmann::json* place(nlohmann::json value) {
    if (levels_.empty()) {
      document = std::move(value);
      return &document;
    }
    nlohmann::json& parent = *levels_.back();
    if (parent.is_array()) {
      parent.push_back(std::move(value));
      return &parent.back();
    }
    return &(parent[key_] = std::move(value));
  }
  bool add(nlohmann::json value) {
    if (!has_room()) return false;
    place(std::move(value));
    if (!sizes_.empty()) ++sizes_.back();
    return true;
  }
  bool open(nlohmann::json value) {
    if (levels_.size() >= static_cast<std::size_t>(kDeepestDocument))
      return refuse("nested deeper than " + std::to_string(kDeepestDocument) + " levels");
    if (!has_room()) return false;
    if (!keys_.empty()) keys_.back() = key_;
    nlohmann::json* opened = place(std::move(value));
    levels_.push_back(opened);
    keys_.emplace_back();
    sizes_.push_back(0);
    return true;
  }
  bool close() {
    levels_.pop_back();
    keys_.pop_back();
    sizes_.pop_back();
    if (!sizes_.empty()) ++sizes_.back();
    return true;
  }

  std::vector<nlohmann::json*> levels_;  // arrays and objects that are open
  std::vector<std::string> keys_;        // the key at each level
  std::vector<std::size_t> sizes_;       // the elements so far at each level
  std::string key_;
  std::size_t value_count_ = 0;
};

/// Drops what comes after the first ones. Returns how many faults that was.
std::size_t shorten(std::vector<Fault>& faults) {
  std::size_t dropped = 0;
  for (std::size_t i = kMostFaultsListed; i < faults.size(); ++i)
    dropped += faults[i].count;
  if (dropped > 0) faults.resize(kMostFaultsListed);
  return dropped;
}

std::string summary(const std::vector<Fault>& faults) {
  std::string text;
  for (const Fault& fault : faults | std::views::take(kMostFaultsListed))
    text += (text.empty() ? "" : "; ") + fault.pointer + ": " + fault.detail;
  return text;
}

}  // namespace

InvalidRequest::InvalidRequest(std::vector<Fault> faults, bool malformed)
    : std::runtime_error(summary(faults)),
      faults_(std::move(faults)),
      further_faults_(shorten(faults_)),
      malformed_(malformed) {}

nlohmann::json parse_document(std::string_view text) {
  StrictReader reader;
  // nlohmann's parser takes a NUL for the end of the text.
  if (const auto nul = text.find('\0'); nul != std::string_view::npos)
    throw InvalidRequest({{"", "not JSON: a NUL at byte " + std::to_string(nul + 1)}}, true);
  const bool whole = nlohmann::json::sax_parse(text.begin(), text.end(), &reader);
  if (!whole || !reader.faults.empty()) {
    CHECK(!reader.faults.empty());
    throw InvalidRequest(std::move(reader.faults), reader.malformed);
  }
  return std::move(reader.document);
}

void refuse_unknown_fields(const nlohmann::json& object, std::string_view pointer,
                           const std::function<bool(const std::string&)>& is_known, const std::string& detail,
                           std::vector<Fault>& faults) {
  for (const auto& [name, value] : object.items()) {
    if (is_known(name)) continue;
    if (faults.size() <= kMostFaultsListed)
      faults.push_back({append_pointer(pointer, name), detail});
    else
      ++faults.back().count;
  }
}

std::string append_pointer(std::string_view pointer, std::string_view token) {
  std::string text(pointer);
  text += '/';
  for (const char character : token) {
    if (character == '~')
      text += "~0";
    else if (character == '/')
      text += "~1";
    else
      text += character;
  }
  return text;
}

std::string append_pointer(std::string_view pointer, std::size_t index) {
  return std::string(pointer) + '/' + std::to_string(index);
}

}  // namespace retake
