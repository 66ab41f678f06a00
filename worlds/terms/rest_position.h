// The term `rest_position`: a body comes to rest near a place. Paper, sections 5.1.1 and 5.4.
// A world whose sampling aims at the place finds the term among its scenario's by its type.
#pragma once

#include <string>

#include "worlds/terms/terms.h"

namespace retake::terms {

/// log p_c is a Gaussian of the distance on the floor between the place and where the body rests; in a flat
/// world of x alone.
class RestPosition final : public Term {
 public:
  struct Place {
    std::string body;
    double x;          ///< [m]
    double z = 0;      ///< [m], of no meaning in a flat world
    double sd;         ///< [m]
    double tolerance;  ///< [m]
  };
  RestPosition(Place place, const Setting& setting);
  const Place& place() const { return place_; }

  std::vector<Measure> measures() const override;
  bool reads_frames() const override { return reads_frames_; }
  TermScore score(const Animation& animation, std::span<double> values) const override;
  double least_when_satisfied() const override;
  Claims claims() const override;
  /// What has settled stays, and who takes part is known from the start.
  double upper_bound(const Animation& so_far) const override;
  /// On the ground, in the body's colour: a dot, a circle as wide as the tolerance, and a ring around a
  /// narrow one, by which it is found. Or a stripe across a flat world.
  std::vector<Body> markers(const Animation& shown) const override;

 private:
  double miss(const Track& track) const;

  Place place_;
  double mark_height_;
  double length_;  ///< [m] by which a place may be missed by default
  std::optional<double> flat_;
  bool reads_frames_;
};

}  // namespace retake::terms
