// See api_document.h.
#include "tests/server/api/api_document.h"

#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <string_view>

namespace retake::test {
namespace {

using nlohmann::json;

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(' ');
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(' ') - first + 1);
}

std::string without_quotes(const std::string& text) {
  return text.size() >= 2 && text.front() == '`' && text.back() == '`' ? text.substr(1, text.size() - 2)
                                                                       : text;
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream row(line.substr(1));
  for (std::string cell; std::getline(row, cell, '|');)
    cells.push_back(trimmed(cell));
  return cells;
}

/// "integer", "[Shape](#shape)" or "one of a, b": a type by itself.
std::string simple_type(const std::string& text) {
  static const std::set<std::string> kNames = {"string", "integer", "number", "boolean",
                                               "object", "time",    "null",   "any"};
  static const std::regex link(R"(\[(\w+)\]\(#[\w-]+\))");
  std::smatch match;
  if (std::regex_match(text, match, link)) return "@" + match[1].str();
  if (text.starts_with("one of ")) return "=" + text.substr(7);
  if (text == "list") return "array";
  if (!kNames.contains(text)) throw std::runtime_error("no type: " + text);
  return text;
}

json type_of(const std::string& text) {
  if (text.starts_with("list of ")) return json::array({type_of(text.substr(8))});
  if (text.starts_with("map of ")) return {{"*", type_of(text.substr(7))}};
  std::string joined, rest = text;
  for (std::size_t place = 0; place != std::string::npos;) {
    place = rest.find(" or ");
    joined += (joined.empty() ? "" : "|") + simple_type(rest.substr(0, place));
    if (place != std::string::npos) rest = rest.substr(place + 4);
  }
  return joined;
}

/// Puts a key such as "kernels[].name" into a shape.
void add_key(json& shape, const std::string& key, std::string type) {
  const bool is_optional = type.starts_with("optional ");
  if (is_optional) type = type.substr(9);
  std::vector<std::string> names;
  std::istringstream parts(key);
  for (std::string name; std::getline(parts, name, '.');)
    names.push_back(name);
  // What may be absent is the map itself, not a key of it.
  const std::size_t optional = names.size() - (names.back() == "*" && names.size() > 1 ? 2 : 1);
  json* place = &shape;
  for (std::size_t i = 0; i < names.size(); ++i) {
    std::string name = names[i];
    const bool is_list = name.ends_with("[]");
    if (is_list) name.resize(name.size() - 2);
    if (is_optional && i == optional) name += '?';
    json& value = (*place)[name];
    const bool is_last = i + 1 == names.size();
    if (is_last && !value.is_null()) throw std::runtime_error("the key is there twice: " + key);
    if (is_last)
      value = type_of(type);
    else if (is_list && value.is_null())
      value = json::array({json::object()});
    place = is_list ? &value[0] : &value;
  }
}

/// Reads line by line, knowing under which heading it is.
class Reader {
 public:
  void read(const std::string& line) {
    static const std::regex heading(R"(##+ (.+))");
    static const std::regex route(R"((GET|POST|PUT|PATCH|DELETE) (/\S*))");
    static const std::regex answer(R"(\*\*(\d{3})\*\*(?: \[(\w+)\])?)");
    std::smatch match;
    if (std::regex_match(line, match, heading)) {
      heading_ = match[1];
      table_.clear();
      route_ = nullptr;
      const std::string title = heading_;
      if (std::regex_match(title, match, route)) {
        document.routes.push_back({.method = match[1], .path = match[2]});
        route_ = &document.routes.back();
      }
    } else if (line.starts_with("|")) {
      read_row(cells_of(line));
    } else {
      table_.clear();
      for (std::sregex_iterator found(line.begin(), line.end(), answer), end; route_ && found != end; ++found)
        route_->answers[std::stoi((*found)[1])] = (*found)[2];
    }
  }

  ApiDocument document;

 private:
  void read_row(const std::vector<std::string>& cells) {
    if (table_.empty()) {
      static const std::set<std::string> kTables = {"key type",    "field type",  "parameter type",
                                                    "type status", "metric type", "event data",
                                                    "command does"};
      table_ = cells[0] + " " + cells.at(1);
      if (!kTables.contains(table_)) throw std::runtime_error("no table of this page: " + table_);
      return;
    }
    if (cells[0].starts_with("---")) return;
    const std::string name = without_quotes(cells[0]), type = cells.at(1);
    if (table_ == "key type") {
      add_key(document.shapes[heading_], name, type);
    } else if (table_ == "field type" && route_) {
      route_->fields.push_back({name, type});
    } else if (table_ == "parameter type" && route_) {
      route_->parameters.push_back({name, type});
    } else if (table_ == "type status") {
      if (!document.problems.emplace(name, std::stoi(type)).second)
        throw std::runtime_error("the problem is there twice: " + name);
    } else if (table_ == "metric type") {
      document.metrics[name] = type;
    } else if (table_ == "event data") {
      document.events[name] = type_of(type).get<std::string>().substr(1);
    } else if (table_ != "command does") {
      throw std::runtime_error("a table of fields or parameters under no route");
    }
  }

  std::string heading_, table_;
  ApiRoute* route_ = nullptr;  ///< under whose heading the line is
};

}  // namespace

ApiDocument read_api_document(const std::string& text) {
  Reader reader;
  std::istringstream lines(text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    try {
      reader.read(line);
    } catch (const std::exception& fault) {
      throw std::runtime_error("doc/api.md:" + std::to_string(number) + ": " + fault.what());
    }
  }
  return std::move(reader.document);
}

const ApiDocument& api_document() {
  static const ApiDocument document = [] {
    std::ifstream file(RETAKE_SOURCE_DIR "/doc/api.md");
    return read_api_document(std::string(std::istreambuf_iterator<char>(file), {}));
  }();
  return document;
}

}  // namespace retake::test
