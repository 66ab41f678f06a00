// See lane.h.
#include "worlds/bowling/lane.h"

#include <cmath>

namespace retake::bowling {

PinBody pin_body() {
  // Three-point Gauss-Legendre is exact for the frusta: their integrands have degree 4 at most.
  const double offset = std::sqrt(0.6);
  const std::array<std::array<double, 2>, 3> nodes = {
      {{-offset, 5.0 / 18}, {0, 8.0 / 18}, {offset, 5.0 / 18}}};
  double volume = 0, first = 0, second = 0, fourth = 0;  // of r^2, h r^2, h^2 r^2 and r^4
  for (std::size_t i = 0; i + 1 < kRings; ++i) {
    const auto [h0, r0] = kPinProfile[i];
    const auto [h1, r1] = kPinProfile[i + 1];
    for (const auto& [place, weight] : nodes) {
      const double share = 0.5 * (1 + place), width = weight * (h1 - h0);
      const double h = h0 + share * (h1 - h0), r = r0 + share * (r1 - r0), squared = r * r;
      volume += width * squared;
      first += width * h * squared;
      second += width * h * h * squared;
      fourth += width * squared * squared;
    }
  }
  const double centre = first / volume, density = kPinMass / volume;
  return {.centre_of_mass = centre,
          .axial_inertia = density * fourth / 2,
          .transverse_inertia = density * (fourth / 4 + second - volume * centre * centre)};
}

}  // namespace retake::bowling
