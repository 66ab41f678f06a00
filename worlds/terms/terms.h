// The general constraint terms, written once for every world with bodies: where, when, in which order, which
// side up. Paper, section 3.2: "constraints can be defined for any aspect of the object's 3D state at any
// point in time". They read the Animation alone and must not know which world made it.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "worlds/term.h"
#include "worlds/terms/roster.h"

namespace retake::terms {

/// What a world tells the general terms of its scenes.
struct Setting {
  std::function<Roster(const Parameters& model)> roster;
  std::string only_body{};         ///< the one mover of the default model; empty if that has several
  double length;                   ///< [m] by which places may be missed by default
  double speed;                    ///< [m/s] by which velocities may be missed by default
  std::string source;              ///< of these two
  double mark_height = 0.001;      ///< [m] by which marks lie above the ground; half their height if flat
  bool rests_need_frames = false;  ///< rests are not known without frames
  /// All motion is in the plane z = 0; how far a mark reaches to either side of it [m].
  std::optional<double> flat{};
  /// [m] from the origin, beyond which nothing can come to rest, whatever is drawn; null: no bound is known.
  std::function<double(const Parameters& model)> reach{};
};

/// The body comes to rest near a place. In a flat world it has the field x alone and is of the only body.
TermKind rest_position_term(const Setting& setting);
/// A side of a body ends up. For worlds whose movers have faces.
TermKind face_up_term(const Setting& setting);
/// A body is near a place, or near a velocity, at a time.
TermKind state_at_term(const Setting& setting);
/// Contacts at given times or on a beat.
TermKind contact_at_term(const Setting& setting);
/// Events happen one after the other.
TermKind order_term(const Setting& setting);
/// A body stays in a box for a while.
TermKind inside_term(const Setting& setting);

/// All of them but face_up.
std::vector<TermKind> general_terms(const Setting& setting);

}  // namespace retake::terms
