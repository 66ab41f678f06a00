// DiceStep: one time step of dice on a table - gravity, contacts, impulses, rest. Paper, section 5.4.
// It must not know what came before or which dice take part later.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "worlds/dice/die.h"
#include "worlds/dice/table.h"
#include "worlds/gravity.h"

namespace retake::dice {

/// How contacts are resolved. Measured values were compared with finer steps; see README.md.
struct EngineSettings {
  double time_step = 0.001;         ///< [s], measured: what rests where agrees from 1 kHz up
  double gravity = kGravity;        ///< [m/s2], along -y
  int sweeps = 8;                   ///< over a step's contacts, at most; measured
  double restitution_speed = 0.1;   ///< [m/s]; slower contacts do not rebound; measured
  double separation = 0.4;          ///< share of an overlap that a step takes away; measured
  double permitted_overlap = 2e-5;  ///< [m] that stays, so that resting contacts last; measured
  double rest_speed = 0.02;         ///< [m/s] of the centre and of what turns around it; measured
  double rest_time = 0.1;           ///< [s] below rest_speed, then it rests
  double waking_speed = 0.05;       ///< [m/s] at which a die that rests has to be hit to move on; chosen
  double die_restitution = 0.4;     ///< of a die on a die; chosen
  double die_friction = 0.25;       ///< of a die on a die; chosen

  std::int32_t rest_steps() const;  ///< rest_time in steps
};

/// What a die touches that is not a die.
inline constexpr std::int32_t kTable = -1;

/// A contact that was faster than EngineSettings::restitution_speed.
struct Hit {
  std::int64_t step;
  std::int32_t die;
  std::int32_t other;      ///< a die with a higher index, or kTable
  double impulse;          ///< [N s], along the normal
  Eigen::Vector3d point;   ///< [m]
  Eigen::Vector3d normal;  ///< unit vector that pushes `die`
};

/// By step, then by the dice.
bool comes_before(const Hit& a, const Hit& b);

/// Two dice touch each other in a step.
struct Meeting {
  std::int64_t step;
  std::int32_t first, second;  ///< ascending
};

/// A die in a step.
struct MovingDie {
  DieState* state;
  std::int32_t index;
  bool rests = false;
  std::vector<FirstTouch>* touches = nullptr;  ///< null: not logged
};

/// Thread safety: one thread at a time. Its memory is reused.
class DiceStep {
 public:
  /// Requires: `shape` and `table` outlive it.
  DiceStep(const EngineSettings& settings, const DieShape& shape, Table& table);

  /// Moves dice by one step, except those that rest, and says which of them rest from now on. A die that
  /// rests is woken by one that hits it. Appends to `hits` and `meetings`, by die. Dice that touch each
  /// other, directly or through others, decide together how they move, and nobody else. Requires: ascending
  /// indices.
  void advance(std::int64_t step, std::span<MovingDie> dice, std::vector<Hit>& hits,
               std::vector<Meeting>& meetings);
  /// Whether two dice may touch each other in the next step.
  bool may_meet(const DieState& a, bool a_rests, const DieState& b, bool b_rests) const;

 private:
  struct Body {
    MovingDie* die;
    std::size_t group = 0;  ///< the first body of those that touch each other
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    double inverse_mass = 0;                                    ///< times the mass; 0: it rests
    Eigen::Matrix3d inverse_inertia = Eigen::Matrix3d::Zero();  ///< times the mass [1/m2]
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();            ///< [m] that overlaps ask for
  };
  /// One direction in which a contact pushes.
  struct Row {
    Eigen::Vector3d direction;
    std::array<Eigen::Vector3d, 2> lever;     ///< [m] of each body: the speed there that its turning makes
    std::array<Eigen::Vector3d, 2> response;  ///< [1/m] of each body: the turning that an impulse makes
    double effective_mass;                    ///< in units of a die's
    double impulse = 0;                       ///< so far, divided by a die's mass [m/s]
  };
  struct Contact {
    std::size_t first;       ///< which of bodies_
    std::size_t second;      ///< or kStill
    Eigen::Vector3d normal;  ///< unit vector that pushes the first
    Eigen::Vector3d point;   ///< [m]
    double overlap;          ///< [m]
    double restitution, friction;
    double wanted_speed = 0;  ///< [m/s] away from each other
    bool hits = false;
    std::array<Row, 3> rows{};  ///< along the normal, and twice across it
  };
  static constexpr std::size_t kStill = static_cast<std::size_t>(-1);

  double meeting_distance() const { return 2 * (shape_.reach() + shape_.rounding()); }
  void fall(DieState& state) const;
  void find_contacts_of_pair(std::size_t a, std::size_t b);
  void find_features_in(std::size_t feature_body, std::size_t box_body);
  void find_table_contacts(std::size_t body);
  void find_meetings(std::int64_t step, std::vector<Meeting>& meetings);
  void join(std::size_t a, std::size_t b);
  void resolve_all(std::span<Contact> group);
  Eigen::Vector3d velocity(const Contact& contact) const;
  void wake(const Contact& contact);
  void prepare(Contact& contact);
  double row_speed(const Contact& contact, const Row& row) const;
  void push(const Contact& contact, Row& row, double impulse);
  double resolve(Contact& contact);
  void separate(const Contact& contact);
  void note_hit(std::int64_t step, const Contact& contact, std::vector<Hit>& hits) const;
  void settle(MovingDie& die) const;

  EngineSettings settings_;
  const DieShape& shape_;
  Table& table_;
  Eigen::Matrix3d cube_inverse_inertia_;  ///< in every orientation, if the die is a cube
  double feature_reach_;  ///< [m] above the highest point of the surface near it in which a feature may touch
  double rest_speed_squared_;
  std::vector<Body> bodies_;
  std::vector<Contact> contacts_;
};

}  // namespace retake::dice
