// Words: how numbers, bodies and lists read in a sentence. For what worlds and terms say to people.
// It must not know any world.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace retake {

/// A number with at most four significant digits.
std::string in_words(double value);
/// A stretch of time [s]: "30 ms", "1.5 s".
std::string seconds_in_words(double seconds);
/// A place or a vector: "(0.5, 0, 1)".
std::string in_words(std::span<const double> components);
/// "a, b and c".
std::string list_in_words(const std::vector<std::string>& items);
/// A name as people read it: "bin_of_ball" is "bin of ball".
std::string spaced(std::string_view name);
/// A body by its name, as the subject of a sentence: "pin_7" is "pin 7", "ball" is "the ball".
std::string body_in_words(std::string_view name);

}  // namespace retake
