// See words.h.
#include "worlds/words.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace retake {

std::string in_words(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value + 0.0);  // -0 is 0
  return text;
}

std::string seconds_in_words(double seconds) {
  return std::abs(seconds) < 0.1 && seconds != 0 ? in_words(1000 * seconds) + " ms"
                                                 : in_words(seconds) + " s";
}

std::string in_words(std::span<const double> components) {
  std::string text;
  for (const double component : components)
    text += (text.empty() ? "(" : ", ") + in_words(component);
  return text + ")";
}

std::string list_in_words(const std::vector<std::string>& items) {
  std::string text;
  for (std::size_t i = 0; i < items.size(); ++i)
    text += (i == 0 ? "" : i + 1 == items.size() ? " and " : ", ") + items[i];
  return text;
}

std::string spaced(std::string_view name) {
  std::string text(name);
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

std::string body_in_words(std::string_view name) {
  const bool has_number = name.find_first_of("0123456789") != std::string_view::npos;
  return (has_number ? "" : "the ") + spaced(name);
}

}  // namespace retake
