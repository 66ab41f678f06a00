// HitLog: the contacts of many steps told as hits - who, when, where and how hard.
// It must not know Bullet.
#pragma once

#include <cstddef>
#include <vector>

#include "worlds/bowling/contacts.h"

namespace retake::bowling {

/// What one body does to another one.
struct Hit {
  double time;             ///< [s]
  std::size_t first;       ///< a body: 0 the ball, then the pins in the rack's order
  std::size_t second;      ///< a body, if `with` is pin; else meaningless
  Surface with;            ///< the second body's surface
  double impulse;          ///< [N s]
  Eigen::Vector3d point;   ///< [m]
  Eigen::Vector3d normal;  ///< unit vector that pushes the first body
};

/// A hit begins when two bodies meet with some speed and ends when they part; what rests or rolls is none.
class HitLog {
 public:
  explicit HitLog(std::size_t bodies);
  void clear();
  /// In a step two bodies touch, approaching at this speed [m/s] before its impulses. Several times a step if
  /// they touch in several points.
  void touch(std::size_t first, std::size_t second, const Contact& contact, double approach);
  /// The impulse [N s] that a contact of a step got.
  void push(std::size_t first, std::size_t second, Surface with, double impulse, double time);
  void end_step();
  /// Ends the hits under way. The hits so far, in order of time.
  const std::vector<Hit>& finish();

 private:
  struct Encounter {  ///< of a body with another one or with a surface, while it lasts
    bool hit = false;
    bool seen = false;  ///< in this step
    double start = -1;  ///< [s]; negative until its first impulse
    double impulse = 0;
    Eigen::Vector3d point = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  };
  Encounter& encounter(std::size_t first, std::size_t second, Surface with);
  void close(std::size_t first, std::size_t partner);

  std::size_t bodies_, partners_;
  std::vector<Encounter> encounters_;  ///< a row for each body: a partner for each body, then each surface
  std::vector<Hit> hits_;
};

}  // namespace retake::bowling
