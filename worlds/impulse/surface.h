// Surface: what stands still while spheres move, known by the contacts of a sphere with it.
// Paper, sections 5.3 and 5.4. It must not know velocities, time or runs.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include <Eigen/Core>

namespace retake::impulse {

/// Where a sphere overlaps something.
struct SurfaceContact {
  Eigen::Vector3d normal;  ///< unit vector that pushes the sphere
  double overlap;          ///< [m], positive
};

/// At most eight, the deepest ones first.
class SurfaceContacts {
 public:
  static constexpr std::size_t kMost = 8;
  void clear() { count_ = 0; }
  bool full() const { return count_ == contacts_.size(); }
  /// Requires: not full().
  void add(const SurfaceContact& contact) { contacts_[count_++] = contact; }
  std::span<const SurfaceContact> list() const { return {contacts_.data(), count_}; }

 private:
  std::array<SurfaceContact, kMost> contacts_;
  std::size_t count_ = 0;
};

/// An exact surface of which parts can be moved: its vertices belong to groups, and each group has an
/// offset. Space is divided into regions. Which region a place is in, and which groups matter there, does
/// not depend on the offsets; so it is known before a group moves which spheres notice.
/// Thread safety: one thread at a time; what is immutable in it is shared by those that derive from it.
class Surface {
 public:
  virtual ~Surface() = default;
  virtual std::size_t group_count() const = 0;
  /// Offsets of the groups from where the surface was built [m]. Cheap where few differ from those before.
  /// Requires: one for each group, no component above max_offset().
  virtual void set_offsets(std::span<const Eigen::Vector3d> offsets) = 0;
  virtual double max_offset() const = 0;  ///< [m]
  /// A pure function of the place.
  virtual std::uint32_t region(const Eigen::Vector3d& centre) const = 0;
  /// The groups on which the contacts of a sphere whose centre is in the region may depend, ascending.
  virtual std::span<const std::uint32_t> groups(std::uint32_t region) const = 0;
  /// Fills `contacts` with those of a sphere. Requires: region == region(centre).
  virtual void find_contacts(std::uint32_t region, const Eigen::Vector3d& centre,
                             SurfaceContacts& contacts) const = 0;
};

}  // namespace retake::impulse
