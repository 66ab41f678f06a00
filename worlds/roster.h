// Roster: the bodies of a scene by the names that constraints use.
// doc/design.md, section 4. It must not know which world it is of.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

namespace retake {

/// A side that a body can show, such as that of a die with six pips.
struct Face {
  int number;
  Eigen::Vector3d normal;  ///< unit vector outwards, in the frame of the body's poses
};

/// All bodies that animations of a scene may have, as far as constraints can name them.
struct Roster {
  struct Mover {
    std::string name;           ///< of its Track
    std::vector<Face> faces{};  ///< none: it has no sides
    bool tells_rest = false;    ///< Track::settled says when it comes to rest
    bool tells_fall = false;    ///< Track::fell says when it falls
  };
  std::vector<Mover> movers;       ///< an animation may lack some
  std::vector<std::string> still;  ///< what else can be hit, as it follows the movers in Animation::bodies
};

}  // namespace retake
