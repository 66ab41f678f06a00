// See request_fields.h.
#include "server/api/request_fields.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>

#include "server/http/problem.h"
#include "worlds/parameters.h"

namespace retake {
namespace {

using nlohmann::json;

std::string list(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names)
    text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::string between(std::uint64_t low, std::uint64_t high) {
  return "must be an integer from " + std::to_string(low) + " to " + std::to_string(high);
}

}  // namespace

// --- BodyFields -------------------------------------------------------------------------------

BodyFields::BodyFields(std::shared_ptr<Shared> shared, const json* object, std::string pointer)
    : shared_(std::move(shared)), object_(object), pointer_(std::move(pointer)) {
  shared_->known[pointer_];
}

BodyFields BodyFields::parse(std::string_view body) {
  auto shared = std::make_shared<Shared>();
  shared->document = body.empty() ? json::object() : parse_document(body);
  const json& document = shared->document;
  if (!document.is_object())
    throw InvalidRequest({{"", "expected an object, got " + std::string(document.type_name())}});
  return BodyFields(shared, &document, "");
}

const json* BodyFields::find(std::string_view name) {
  shared_->known[pointer_].emplace_back(name);
  if (!object_) return nullptr;
  const auto found = object_->find(name);
  return found == object_->end() ? nullptr : &*found;
}

void BodyFields::refuse(std::string_view name, std::string detail) {
  shared_->faults.push_back({append_pointer(pointer_, name), std::move(detail)});
}

std::optional<std::uint64_t> BodyFields::integer(std::string_view name, std::uint64_t low,
                                                 std::uint64_t high) {
  const json* value = find(name);
  if (!value) return std::nullopt;
  const double number = value->is_number() ? value->get<double>() : -1;
  // 20000.0 is the integer 20000 to JSON Schema.
  if (!value->is_number() || number != std::floor(number) || number < static_cast<double>(low) ||
      number > static_cast<double>(high)) {
    refuse(name, between(low, high));
    return std::nullopt;
  }
  return value->is_number_float() ? static_cast<std::uint64_t>(number) : value->get<std::uint64_t>();
}

std::optional<double> BodyFields::number_above(std::string_view name, double low) {
  const json* value = find(name);
  if (!value) return std::nullopt;
  if (!value->is_number() || !(value->get<double>() > low)) {
    refuse(name, "must be a number above " + plain_number(low));
    return std::nullopt;
  }
  return value->get<double>();
}

std::optional<std::string> BodyFields::text(std::string_view name, std::size_t longest) {
  const json* value = find(name);
  if (!value) return std::nullopt;
  if (!value->is_string() || value->get_ref<const std::string&>().empty() ||
      value->get_ref<const std::string&>().size() > longest) {
    refuse(name, "must be a string of 1 to " + std::to_string(longest) + " bytes");
    return std::nullopt;
  }
  return value->get<std::string>();
}

std::optional<std::string> BodyFields::choice(std::string_view name,
                                              const std::vector<std::string>& choices) {
  const json* value = find(name);
  if (!value) return std::nullopt;
  if (!value->is_string() ||
      std::find(choices.begin(), choices.end(), value->get_ref<const std::string&>()) == choices.end()) {
    refuse(name, "must be one of " + list(choices));
    return std::nullopt;
  }
  return value->get<std::string>();
}

BodyFields BodyFields::object(std::string_view name) {
  const json* value = find(name);
  if (value && !value->is_object()) {
    refuse(name, "expected an object, got " + std::string(value->type_name()));
    value = nullptr;
  }
  return BodyFields(shared_, value, append_pointer(pointer_, name));
}

void BodyFields::finish() {
  for (const auto& [pointer, known] : shared_->known) {
    const json::json_pointer place(pointer);
    if (shared_->document.contains(place) && shared_->document[place].is_object())
      refuse_unknown_fields(
          shared_->document[place], pointer,
          [&known](const std::string& name) { return std::ranges::find(known, name) != known.end(); },
          "there is no such field here; known are " + list(known), shared_->faults);
  }
  if (!shared_->faults.empty()) throw InvalidRequest(std::move(shared_->faults));
}

// --- QueryFields ------------------------------------------------------------------------------

std::uint64_t QueryFields::integer(const std::string& name, std::uint64_t low, std::uint64_t high,
                                   std::uint64_t fallback) {
  known_.push_back(name);
  const auto found = query_.find(name);
  if (found == query_.end()) return fallback;
  const std::string& text = found->second;
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value < low || value > high) {
    refuse(name, between(low, high));
    return fallback;
  }
  return value;
}

std::string QueryFields::text(const std::string& name, std::string fallback) {
  known_.push_back(name);
  const auto found = query_.find(name);
  return found == query_.end() ? std::move(fallback) : found->second;
}

void QueryFields::refuse(const std::string& name, const std::string& detail) {
  faults_.push_back({"", "query parameter " + name + " " + detail});
}

void QueryFields::finish() {
  for (const auto& [name, value] : query_)
    if (std::find(known_.begin(), known_.end(), name) == known_.end())
      refuse(name, "is unknown; known are " + (known_.empty() ? "none" : list(known_)));
  if (!faults_.empty())
    throw HttpProblem(400, "bad-query", "The query is wrong", faults_.front().detail, faults_);
}

}  // namespace retake
