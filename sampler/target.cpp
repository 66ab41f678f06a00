// See target.h.
#include "sampler/target.h"

namespace retake {

std::string_view to_string(Method method) {
  switch (method) {
    case Method::metropolis:
      return "metropolis";
    case Method::rejection:
      return "rejection";
    case Method::conditional:
      return "conditional";
    case Method::tempering:
      return "tempering";
  }
  return "";
}

std::optional<Method> method_from(std::string_view name) {
  for (const Method method : kMethods)
    if (to_string(method) == name) return method;
  return std::nullopt;
}

std::string_view to_string(Ratios ratios) {
  return ratios == Ratios::exact ? "exact" : "paper";
}

std::optional<Ratios> ratios_from(std::string_view name) {
  for (const Ratios ratios : kRatios)
    if (to_string(ratios) == name) return ratios;
  return std::nullopt;
}

}  // namespace retake
