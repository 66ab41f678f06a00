// See animation.h.
#include "worlds/animation.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace retake {
namespace {

/// Feeds numbers to XXH3 in a fixed order.
class Digest {
 public:
  Digest() { XXH3_128bits_reset(&state_); }
  void add(const double* values, std::size_t count) {
    XXH3_128bits_update(&state_, values, count * sizeof(double));
  }
  void add(double value) { add(&value, 1); }
  void add(const Pose& pose) {
    add(pose.position.data(), 3);
    add(pose.rotation.coeffs().data(), 4);
  }
  void add(std::size_t value) {
    const std::uint64_t wide = value;
    XXH3_128bits_update(&state_, &wide, sizeof wide);
  }
  std::string text() const {
    const XXH128_hash_t hash = XXH3_128bits_digest(&state_);
    XXH128_canonical_t bytes;
    XXH128_canonicalFromHash(&bytes, hash);
    static constexpr char kDigits[] = "0123456789abcdef";
    std::string hexadecimal;
    for (const unsigned char byte : bytes.digest) {
      hexadecimal += kDigits[byte >> 4];
      hexadecimal += kDigits[byte & 15];
    }
    return hexadecimal;
  }

 private:
  XXH3_state_t state_;
};

/// Between the four points around; none beside the field.
std::optional<double> height_at(const HeightField& field, double x, double z) {
  if (field.rows < 2 || field.columns < 2) return std::nullopt;
  const double row = x / field.spacing, column = z / field.spacing;
  const auto last_row = static_cast<double>(field.rows - 1),
             last_column = static_cast<double>(field.columns - 1);
  if (!(row >= 0 && row <= last_row && column >= 0 && column <= last_column)) return std::nullopt;
  const double i = std::min(std::floor(row), last_row - 1), j = std::min(std::floor(column), last_column - 1);
  const double u = row - i, v = column - j;
  const double* corner =
      &field.heights[static_cast<std::size_t>(i) * field.columns + static_cast<std::size_t>(j)];
  const double* next = corner + field.columns;
  return (1 - u) * ((1 - v) * corner[0] + v * corner[1]) + u * ((1 - v) * next[0] + v * next[1]);
}

constexpr std::array<std::string_view, kSurfaces> kSurfaceNames = {
    "plain", "wood",  "boards", "varnished", "felt",    "cloth",   "plastic", "polished",
    "glass", "metal", "rubber", "stone",     "plaster", "marking", "lamp",    "shade"};

}  // namespace

std::string_view to_string(Surface surface) {
  return kSurfaceNames[static_cast<std::size_t>(surface)];
}

void put_in_one_hemisphere(Rotations& rotations) {
  for (Eigen::Index frame = 1; frame < rotations.cols(); ++frame)
    rotations.col(frame) = nearer(rotations.col(frame), rotations.col(frame - 1));
}

Mesh mesh_of(const HeightField& field) {
  Mesh mesh;
  mesh.positions.reserve(3 * field.point_count());
  for (std::size_t row = 0; row < field.rows; ++row)
    for (std::size_t column = 0; column < field.columns; ++column)
      mesh.positions.insert(mesh.positions.end(), {static_cast<double>(row) * field.spacing,
                                                   field.heights[row * field.columns + column],
                                                   static_cast<double>(column) * field.spacing});
  for (std::size_t row = 0; row + 1 < field.rows; ++row)
    for (std::size_t column = 0; column + 1 < field.columns; ++column) {
      // From x to z is clockwise, seen from above.
      const auto a = static_cast<std::uint32_t>(row * field.columns + column);
      const auto b = static_cast<std::uint32_t>(a + field.columns);
      mesh.indices.insert(mesh.indices.end(), {a, b + 1, b, a, a + 1, b + 1});
    }
  return mesh;
}

double ground_height(const Animation& animation, double x, double z) {
  std::optional<double> highest;
  for (const Body& body : animation.bodies) {
    const auto* field = std::get_if<HeightField>(&body.shape);
    if (!field || body.track) continue;
    const Eigen::Vector3d place =
        body.pose.rotation.conjugate() * (Eigen::Vector3d(x, 0, z) - body.pose.position);
    if (const auto height = height_at(*field, place.x(), place.z()))
      highest = std::max(highest.value_or(-INFINITY), body.pose.position.y() + *height);
  }
  return highest.value_or(0);
}

std::string digest(const State& state, const Animation& animation) {
  Digest bits;
  bits.add(state.data(), static_cast<std::size_t>(state.size()));
  bits.add(animation.rate);
  bits.add(animation.frames);
  for (const Track& track : animation.tracks) {
    // Left out where it says nothing, so that motions without late bodies have the digests that they had.
    if (track.from > 0) bits.add(track.from);
    bits.add(track.rest);
    bits.add(track.positions.data(), static_cast<std::size_t>(track.positions.size()));
    bits.add(track.rotations.data(), static_cast<std::size_t>(track.rotations.size()));
  }
  for (const ContactEvent& event : animation.events) {
    bits.add(event.time);
    bits.add(event.bodies[0]);
    bits.add(event.bodies[1]);
    bits.add(event.impulse);
    bits.add(event.position.data(), 3);
    bits.add(event.normal.data(), 3);
  }
  return bits.text();
}

}  // namespace retake
