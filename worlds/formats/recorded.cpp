// See recorded.h.
#include "worlds/formats/recorded.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include <zstd.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

#include "sampler/bytes.h"
#include "sampler/check.h"

namespace retake {
namespace {

constexpr std::uint8_t kVersion = 3;
constexpr std::uint8_t kPlainMeshes = 1;           // the version whose meshes are floats
constexpr std::uint8_t kFirstWithSurfaces = 3;     // the version from which on bodies tell their surface
constexpr std::uint8_t kFirstWithAppearances = 3;  // ... and tracks from when on they are there
constexpr int kCompressionLevel = 1;               // measured: higher levels gain under 5 % here
constexpr double kPositionQuantum = 1.0 / 16384;   // [m]: errors up to 0.031 mm a component
constexpr double kRotationQuantum = 1.0 / 8192;    // errors up to 0.014 degree
constexpr double kMeshQuantum = 0x1p-18;           // [m]: a facet of 0.3 mm leans by less than a degree
constexpr double kHeightQuantum = 0x1p-16;         // [m]: of height fields, 0.015 mm
constexpr double kAttributeQuantum = 0.01;         // as the keyframe document gives them
constexpr double kLargestScaled = 0x1p60;          // so that second differences stay within 64 bits
constexpr Eigen::Index kMostPlain = 16;            // numbers of a State that are not compressed, chosen
constexpr std::size_t kRecordHead = 1 + sizeof(std::uint64_t);  // [bytes] version and checksum
constexpr std::size_t kLargestRecord = std::size_t{1}
                                       << 28;  // bytes when unpacked; chosen far above any animation

/// How many quanta a value is, rounded.
std::int64_t quanta(double value, double quantum) {
  const double scaled = value / quantum;
  CHECK(std::abs(scaled) < kLargestScaled, value);
  return static_cast<std::int64_t>(scaled + (scaled < 0 ? -0.5 : 0.5));
}

// Unsigned, so that damaged numbers wrap instead of overflowing.
std::int64_t plus(std::int64_t left, std::int64_t right) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(left) + static_cast<std::uint64_t>(right));
}
std::int64_t minus(std::int64_t left, std::int64_t right) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(left) - static_cast<std::uint64_t>(right));
}

// --- Numbers of a track: the second difference of the quantised values, which is small for smooth motion ---

template <typename Matrix>
void put_frames(ByteWriter& out, const Matrix& values, double quantum) {
  for (Eigen::Index row = 0; row < values.rows(); ++row) {
    std::int64_t before = 0, last = 0;
    for (Eigen::Index frame = 0; frame < values.cols(); ++frame) {
      const std::int64_t now = quanta(values(row, frame), quantum);
      out.put_varint(now - (2 * last - before));
      before = frame == 0 ? now : last;
      last = now;
    }
  }
}

template <typename Matrix>
void get_frames(ByteReader& in, Matrix& values, double quantum) {
  for (Eigen::Index row = 0; row < values.rows(); ++row) {
    std::int64_t before = 0, last = 0;
    for (Eigen::Index frame = 0; frame < values.cols(); ++frame) {
      const std::int64_t now = plus(in.get_varint(), minus(plus(last, last), before));
      before = frame == 0 ? now : last;
      last = now;
      values(row, frame) = static_cast<double>(now) * quantum;
    }
  }
}

// --- Numbers of a mesh: coordinate by coordinate, each as its difference from the vertex before ------------

void put_mesh(ByteWriter& out, const Mesh& mesh) {
  CHECK(mesh.positions.size() % 3 == 0, mesh.positions.size());
  out.put(static_cast<std::uint32_t>(mesh.positions.size() / 3));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::int64_t last = 0;
    for (std::size_t i = axis; i < mesh.positions.size(); i += 3) {
      const std::int64_t now = quanta(mesh.positions[i], kMeshQuantum);
      out.put_varint(now - last);
      last = now;
    }
  }
  out.put(static_cast<std::uint32_t>(mesh.indices.size()));
  std::int64_t next = 0;  // the first vertex that no triangle has had so far: mostly the one that comes
  for (const std::uint32_t index : mesh.indices) {
    out.put_varint(next - index);
    next = std::max(next, std::int64_t{index} + 1);
  }
}

// --- Numbers of a grid: each less what its three neighbours before it foretell -----------------------------

void put_grid(ByteWriter& out, const std::vector<double>& values, std::size_t columns, double quantum) {
  std::vector<std::int64_t> before(columns, 0);
  for (std::size_t i = 0; i < values.size();) {
    std::int64_t left = 0, corner = 0;
    for (std::int64_t& above : before) {
      const std::int64_t now = quanta(values[i++], quantum);
      out.put_varint(now - (left + above - corner));
      corner = std::exchange(above, now);
      left = now;
    }
  }
}

void get_grid(ByteReader& in, std::vector<double>& values, std::size_t columns, double quantum) {
  std::vector<std::int64_t> before(columns, 0);
  for (std::size_t i = 0; i < values.size();) {
    std::int64_t left = 0, corner = 0;
    for (std::int64_t& above : before) {
      const std::int64_t now = plus(in.get_varint(), minus(plus(left, above), corner));
      values[i++] = static_cast<double>(now) * quantum;
      corner = std::exchange(above, now);
      left = now;
    }
  }
}

void put_field(ByteWriter& out, const HeightField& field) {
  CHECK(field.heights.size() == field.point_count(), field.heights.size());
  out.put(static_cast<std::uint32_t>(field.rows));
  out.put(static_cast<std::uint32_t>(field.columns));
  out.put(field.spacing);
  put_grid(out, field.heights, field.columns, kHeightQuantum);
  out.put(static_cast<std::uint32_t>(field.attributes.size()));
  for (const Attribute& attribute : field.attributes) {
    CHECK(attribute.values.size() == field.point_count(), attribute.values.size());
    out.put_text(attribute.name);
    put_grid(out, attribute.values, field.columns, kAttributeQuantum);
  }
}

void put_pose(ByteWriter& out, const Pose& pose) {
  for (const double value : pose.position)
    out.put(value);
  for (const double value : pose.rotation.coeffs())
    out.put(value);
}

Pose get_pose(ByteReader& in) {
  Pose pose;
  for (double& value : pose.position)
    value = in.get<double>();
  for (double& value : pose.rotation.coeffs())
    value = in.get<double>();
  return pose;
}

// --- Shapes: the index of the alternative, then its numbers ------------------------------------

void put_shape(ByteWriter& out, const Shape& shape) {
  out.put(static_cast<std::uint8_t>(shape.index()));
  if (const auto* sphere = std::get_if<Sphere>(&shape)) {
    out.put(sphere->radius);
  } else if (const auto* box = std::get_if<Box>(&shape)) {
    for (const double value : box->half_extents)
      out.put(value);
  } else if (const auto* cylinder = std::get_if<Cylinder>(&shape)) {
    out.put(cylinder->radius);
    out.put(cylinder->height);
  } else if (const auto* revolution = std::get_if<Revolution>(&shape)) {
    out.put(static_cast<std::uint32_t>(revolution->profile.size()));
    for (const auto& [radius, y] : revolution->profile) {
      out.put(radius);
      out.put(y);
    }
  } else if (const auto* mesh = std::get_if<Mesh>(&shape)) {
    put_mesh(out, *mesh);
  } else if (const auto* field = std::get_if<HeightField>(&shape)) {
    put_field(out, *field);
  }
}

/// A count of things of at least `least_bytes` each, so that a damaged count cannot ask for more than there
/// is.
std::uint32_t get_count(ByteReader& in, std::size_t least_bytes) {
  const auto count = in.get<std::uint32_t>();
  if (count * least_bytes > in.remaining()) throw std::out_of_range("a count is too large");
  return count;
}

Mesh get_mesh(ByteReader& in) {
  Mesh mesh;
  mesh.positions.resize(3 * std::size_t{get_count(in, 3)});
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::int64_t last = 0;
    for (std::size_t i = axis; i < mesh.positions.size(); i += 3) {
      last = plus(last, in.get_varint());
      mesh.positions[i] = static_cast<double>(last) * kMeshQuantum;
    }
  }
  mesh.indices.resize(get_count(in, 1));
  std::int64_t next = 0;
  for (std::uint32_t& index : mesh.indices) {
    index = static_cast<std::uint32_t>(minus(next, in.get_varint()));
    next = std::max(next, std::int64_t{index} + 1);
  }
  return mesh;
}

Mesh get_plain_mesh(ByteReader& in) {
  Mesh mesh;
  mesh.positions.resize(get_count(in, 4));
  for (double& value : mesh.positions)
    value = in.get<float>();
  mesh.indices.resize(get_count(in, 1));
  for (std::uint32_t& index : mesh.indices)
    index = static_cast<std::uint32_t>(in.get_varint());
  return mesh;
}

HeightField get_field(ByteReader& in) {
  HeightField field;
  field.rows = in.get<std::uint32_t>();
  field.columns = in.get<std::uint32_t>();
  field.spacing = in.get<double>();
  if (field.point_count() > in.remaining() || (field.columns == 0) != (field.rows == 0))
    throw std::out_of_range("a height field is too large");
  field.heights.resize(field.point_count());
  get_grid(in, field.heights, field.columns, kHeightQuantum);
  field.attributes.resize(get_count(in, 4 + field.point_count()));
  for (Attribute& attribute : field.attributes) {
    attribute.name = in.get_text();
    attribute.values.resize(field.point_count());
    get_grid(in, attribute.values, field.columns, kAttributeQuantum);
  }
  return field;
}

Shape get_shape(ByteReader& in, std::uint8_t version) {
  switch (in.get<std::uint8_t>()) {
    case 0:
      return Sphere{in.get<double>()};
    case 1: {
      Box box;
      for (double& value : box.half_extents)
        value = in.get<double>();
      return box;
    }
    case 2: {
      const auto radius = in.get<double>();
      return Cylinder{radius, in.get<double>()};
    }
    case 3: {
      Revolution revolution;
      revolution.profile.resize(get_count(in, 16));
      for (auto& [radius, y] : revolution.profile) {
        radius = in.get<double>();
        y = in.get<double>();
      }
      return revolution;
    }
    case 4:
      return version == kPlainMeshes ? get_plain_mesh(in) : get_mesh(in);
    case 5:
      return get_field(in);
    default:
      throw std::out_of_range("an unknown shape");
  }
}

Surface get_surface(ByteReader& in) {
  const auto number = in.get<std::uint8_t>();
  if (number >= kSurfaces) throw std::out_of_range("an unknown surface");
  return static_cast<Surface>(number);
}

// --- The whole ----------------------------------------------------------------------------------

std::string pack(const Animation& animation) {
  ByteWriter out;
  out.put(animation.rate);
  out.put(static_cast<std::uint32_t>(animation.frames));
  out.put(static_cast<std::uint32_t>(animation.bodies.size()));
  for (const Body& body : animation.bodies) {
    out.put_text(body.name);
    put_shape(out, body.shape);
    out.put_text(body.colour);
    out.put(static_cast<std::uint8_t>(body.surface));
    out.put(body.track ? static_cast<std::int32_t>(*body.track) : -1);
    if (!body.track) put_pose(out, body.pose);
  }
  out.put(static_cast<std::uint32_t>(animation.tracks.size()));
  for (const Track& track : animation.tracks) {
    CHECK(track.positions.cols() == static_cast<Eigen::Index>(animation.frames), track.positions.cols());
    put_pose(out, track.rest);
    out.put(track.from);
    put_frames(out, track.positions, kPositionQuantum);
    Rotations rotations = track.rotations;
    put_in_one_hemisphere(rotations);
    put_frames(out, rotations, kRotationQuantum);
  }
  out.put(static_cast<std::uint32_t>(animation.events.size()));
  for (const ContactEvent& event : animation.events) {
    out.put(event.time);
    for (const std::size_t body : event.bodies)
      out.put(static_cast<std::uint32_t>(body));
    out.put(static_cast<float>(event.impulse));
    for (const double value : event.position)
      out.put(static_cast<float>(value));
    for (const double value : event.normal)
      out.put(static_cast<float>(value));
  }
  return out.take();
}

Animation unpack(std::string_view bytes, std::uint8_t version) {
  ByteReader in(bytes);
  Animation animation;
  animation.rate = in.get<double>();
  animation.frames = in.get<std::uint32_t>();
  animation.bodies.resize(get_count(in, 13));
  for (Body& body : animation.bodies) {
    body.name = in.get_text();
    body.shape = get_shape(in, version);
    body.colour = in.get_text();
    if (version >= kFirstWithSurfaces) body.surface = get_surface(in);
    const auto track = in.get<std::int32_t>();
    if (track >= 0)
      body.track = static_cast<std::size_t>(track);
    else
      body.pose = get_pose(in);
  }
  animation.tracks.resize(get_count(in, 56));
  for (Track& track : animation.tracks) {
    track.rest = get_pose(in);
    if (version >= kFirstWithAppearances) track.from = in.get<double>();
    if (!(track.from >= 0 && std::isfinite(track.from))) throw std::out_of_range("a body appears at no time");
    if (animation.frames * 7 > in.remaining()) throw std::out_of_range("too many frames");
    const auto frames = static_cast<Eigen::Index>(animation.frames);
    track.positions.resize(3, frames);
    get_frames(in, track.positions, kPositionQuantum);
    track.rotations.resize(4, frames);
    get_frames(in, track.rotations, kRotationQuantum);
    track.rotations.colwise().normalize();
    // Rounded, half a turn between two frames may be more than half.
    put_in_one_hemisphere(track.rotations);
  }
  animation.events.resize(get_count(in, 44));
  for (ContactEvent& event : animation.events) {
    event.time = in.get<double>();
    for (std::size_t& body : event.bodies)
      body = in.get<std::uint32_t>();
    event.impulse = in.get<float>();
    for (double& value : event.position)
      value = in.get<float>();
    for (double& value : event.normal)
      value = in.get<float>();
  }
  for (const Body& body : animation.bodies)
    if (body.track && *body.track >= animation.tracks.size())
      throw std::out_of_range("a body without its track");
  for (std::size_t track = 0; track < std::min(animation.tracks.size(), animation.bodies.size()); ++track)
    animation.tracks[track].name = animation.bodies[track].name;
  for (const ContactEvent& event : animation.events)
    for (const std::size_t body : event.bodies)
      if (body >= animation.bodies.size()) throw std::out_of_range("an event without its body");
  if (!in.at_end()) throw std::out_of_range("bytes are left over");
  return animation;
}

/// One zstd frame that says its size.
std::string compressed(std::string_view bytes) {
  struct Free {
    void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  };
  thread_local const std::unique_ptr<ZSTD_CCtx, Free> context(ZSTD_createCCtx());
  std::string frame(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size = ZSTD_compressCCtx(context.get(), frame.data(), frame.size(), bytes.data(),
                                             bytes.size(), kCompressionLevel);
  CHECK(!ZSTD_isError(size), ZSTD_getErrorName(size));
  frame.resize(size);
  return frame;
}

/// Throws: std::out_of_range.
std::string decompressed(std::string_view frame) {
  const unsigned long long size = ZSTD_getFrameContentSize(frame.data(), frame.size());
  if (size > kLargestRecord) throw std::out_of_range("it does not say its size");
  std::string bytes(size, '\0');
  if (ZSTD_decompress(bytes.data(), bytes.size(), frame.data(), frame.size()) != size)
    throw std::out_of_range("it does not unpack");
  return bytes;
}

}  // namespace

std::string encode_animation(const Animation& animation) {
  const std::string frame = compressed(pack(animation));
  ByteWriter out;
  out.put(kVersion);
  out.put(static_cast<std::uint64_t>(XXH3_64bits(frame.data(), frame.size())));
  out.put_raw(frame);
  return out.take();
}

std::size_t decoded_bytes(std::string_view bytes) {
  const std::string_view frame = bytes.substr(std::min(kRecordHead, bytes.size()));
  const unsigned long long size = ZSTD_getFrameContentSize(frame.data(), frame.size());
  return size > kLargestRecord ? 0 : size * (1 + sizeof(double));
}

Animation decode_animation(std::string_view bytes) {
  try {
    ByteReader in(bytes);
    const auto version = in.get<std::uint8_t>();
    if (version < kPlainMeshes || version > kVersion) throw std::out_of_range("its version is unknown");
    const auto checksum = in.get<std::uint64_t>();
    const std::string_view frame = bytes.substr(bytes.size() - in.remaining());
    if (XXH3_64bits(frame.data(), frame.size()) != checksum)
      throw std::out_of_range("its checksum does not fit");
    return unpack(decompressed(frame), version);
  } catch (const std::out_of_range& fault) {
    throw DamagedAnimation(std::string("recorded animation is damaged: ") + fault.what());
  }
}

std::string encode_state(const State& state) {
  ByteWriter out;
  out.put_numbers(state.data(), static_cast<std::size_t>(state.size()));
  // Absent values are the same bytes again and again. Few values are plain.
  return state.size() > kMostPlain ? compressed(out.bytes()) : out.take();
}

State decode_state(std::string_view bytes) {
  try {
    // Were this the count of a plain one, it would be longer than any record.
    const bool is_frame = ByteReader(bytes).get<std::uint32_t>() == ZSTD_MAGICNUMBER;
    const std::string unpacked = is_frame ? decompressed(bytes) : std::string();
    ByteReader in(is_frame ? unpacked : bytes);
    State state;
    in.get_numbers(state);
    if (!in.at_end()) throw std::out_of_range("bytes are left over");
    return state;
  } catch (const std::out_of_range& fault) {
    throw DamagedAnimation(std::string("recorded state is damaged: ") + fault.what());
  }
}

}  // namespace retake
