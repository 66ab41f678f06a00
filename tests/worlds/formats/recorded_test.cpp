// The recorded form of an Animation: what comes back, how closely, and that damage is always noticed.
#include "worlds/formats/recorded.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#define XXH_INLINE_ALL
#include <gtest/gtest.h>
#include <xxhash.h>
#include <zstd.h>

#include "sampler/bytes.h"
#include "tests/sampler/statistics.h"
#include "tests/worlds/fixture.h"

namespace retake::tests {
namespace {

constexpr double kDegree = M_PI / 180;

Eigen::Quaterniond draw_rotation(RandomStream& random) {
  Eigen::Quaterniond rotation(random.gaussian(), random.gaussian(), random.gaussian(), random.gaussian());
  return rotation.normalized();
}

Eigen::Vector3d draw_vector(RandomStream& random, double size) {
  return size * Eigen::Vector3d(random.gaussian(), random.gaussian(), random.gaussian());
}

/// A track that a body could follow, or poses without any order.
Track draw_track(RandomStream& random, Eigen::Index frames, bool smooth) {
  Track track{.from = std::max(0.0, random.gaussian()),
              .rest = {draw_vector(random, 3), draw_rotation(random)},
              .positions = {},
              .rotations = {}};
  track.positions.resize(3, frames);
  track.rotations.resize(4, frames);
  const Eigen::Vector3d from = draw_vector(random, 1), velocity = draw_vector(random, 5),
                        axis = draw_vector(random, 8);
  for (Eigen::Index frame = 0; frame < frames; ++frame) {
    const double time = static_cast<double>(frame) / 60;
    const Eigen::Vector3d position =
        smooth ? Eigen::Vector3d(from + velocity * time - Eigen::Vector3d(0, 4.9 * time * time, 0))
               : draw_vector(random, 50);
    const Eigen::Quaterniond rotation =
        smooth ? Eigen::Quaterniond(Eigen::AngleAxisd(axis.norm() * time, axis.normalized()))
               : draw_rotation(random);
    track.positions.col(frame) = position;
    // Either sign stands for the same rotation.
    track.rotations.col(frame) = rotation.coeffs() * (random.bernoulli(0.5) ? 1 : -1);
  }
  return track;
}

/// Numbers that records hold exactly, but for the attribute.
HeightField bumps(RandomStream& random) {
  HeightField field{.rows = 5,
                    .columns = 3,
                    .spacing = 0.0125,
                    .heights = {},
                    .attributes = {{.name = "friction", .values = {}}}};
  for (std::size_t i = 0; i < field.point_count(); ++i) {
    field.heights.push_back(std::round(200 * random.gaussian()) / 65536);
    field.attributes[0].values.push_back(random.uniform());
  }
  return field;
}

Animation draw_animation(std::uint64_t seed, std::size_t frames, bool smooth) {
  RandomStream random = stream(seed);
  Animation animation{.rate = 60, .frames = frames, .bodies = {}, .tracks = {}, .events = {}};
  const std::vector<Shape> shapes = {Sphere{0.1 + random.uniform()},
                                     Box{draw_vector(random, 1).cwiseAbs()},
                                     Cylinder{random.uniform(), random.uniform()},
                                     Revolution{{{0, 0}, {0.06, 0.1}, {0.03, 0.2}, {0, random.uniform()}}},
                                     Mesh{{0, 0, 0, 1.25, 0, 0, 0, 0.5, -0.75}, {0, 1, 2, 2, 1, 0}},
                                     Mesh{},
                                     Revolution{},
                                     bumps(random),
                                     HeightField{}};
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    Body body{.name = "body " + std::to_string(i),
              .shape = shapes[i],
              .colour = "#a0b1c2",
              .surface = static_cast<Surface>((seed + i) % kSurfaces)};
    if (i % 2 == 0) {
      body.track = animation.tracks.size();
      animation.tracks.push_back(draw_track(random, static_cast<Eigen::Index>(frames), smooth));
    } else {
      body.pose = {draw_vector(random, 2), draw_rotation(random)};
    }
    animation.bodies.push_back(std::move(body));
  }
  for (int i = 0; i < 30; ++i)
    animation.events.push_back(
        {.time = 0.1 * i + 0.001 * random.uniform(),
         .bodies = {static_cast<std::size_t>(random.index(9)), static_cast<std::size_t>(random.index(9))},
         .impulse = random.uniform(),
         .position = draw_vector(random, 1),
         .normal = draw_vector(random, 1).normalized()});
  return animation;
}

/// [rad] between two rotations given as quaternions of either sign.
double angle_between(const Eigen::Vector4d& left, const Eigen::Vector4d& right) {
  const Eigen::Quaterniond a(left), b(right);
  return 2 * std::asin(std::min(1.0, (a.conjugate() * b).vec().norm()));
}

void expect_same_shape(const Shape& left, const Shape& right) {
  ASSERT_EQ(left.index(), right.index());
  if (const auto* sphere = std::get_if<Sphere>(&left)) {
    EXPECT_EQ(sphere->radius, std::get<Sphere>(right).radius);
  }
  if (const auto* box = std::get_if<Box>(&left)) {
    EXPECT_EQ(box->half_extents, std::get<Box>(right).half_extents);
  }
  if (const auto* cylinder = std::get_if<Cylinder>(&left)) {
    EXPECT_EQ(cylinder->radius, std::get<Cylinder>(right).radius);
    EXPECT_EQ(cylinder->height, std::get<Cylinder>(right).height);
  }
  if (const auto* revolution = std::get_if<Revolution>(&left)) {
    EXPECT_EQ(revolution->profile, std::get<Revolution>(right).profile);
  }
  if (const auto* mesh = std::get_if<Mesh>(&left)) {
    EXPECT_EQ(mesh->positions, std::get<Mesh>(right).positions);  // representable here
    EXPECT_EQ(mesh->indices, std::get<Mesh>(right).indices);
  }
  if (const auto* field = std::get_if<HeightField>(&left)) {
    const auto& other = std::get<HeightField>(right);
    EXPECT_EQ(field->rows, other.rows);
    EXPECT_EQ(field->columns, other.columns);
    EXPECT_EQ(field->spacing, other.spacing);
    EXPECT_EQ(field->heights, other.heights);
    ASSERT_EQ(field->attributes.size(), other.attributes.size());
    for (std::size_t i = 0; i < field->attributes.size(); ++i) {
      EXPECT_EQ(field->attributes[i].name, other.attributes[i].name);
      ASSERT_EQ(field->attributes[i].values.size(), other.attributes[i].values.size());
      for (std::size_t k = 0; k < field->attributes[i].values.size(); ++k)
        EXPECT_NEAR(field->attributes[i].values[k], other.attributes[i].values[k], 0.005 + 1e-12);
    }
  }
}

void expect_round_trip(const Animation& original) {
  const Animation decoded = decode_animation(encode_animation(original));
  EXPECT_EQ(decoded.rate, original.rate);
  ASSERT_EQ(decoded.frames, original.frames);
  ASSERT_EQ(decoded.bodies.size(), original.bodies.size());
  for (std::size_t i = 0; i < original.bodies.size(); ++i) {
    const Body &left = original.bodies[i], &right = decoded.bodies[i];
    EXPECT_EQ(left.name, right.name);
    EXPECT_EQ(left.colour, right.colour);
    EXPECT_EQ(left.surface, right.surface);
    EXPECT_EQ(left.track, right.track);
    expect_same_shape(left.shape, right.shape);
    if (!left.track) {
      EXPECT_EQ(left.pose.position, right.pose.position);
      EXPECT_EQ(left.pose.rotation.coeffs(), right.pose.rotation.coeffs());
    }
  }
  ASSERT_EQ(decoded.tracks.size(), original.tracks.size());
  for (std::size_t i = 0; i < original.tracks.size(); ++i) {
    const Track &left = original.tracks[i], &right = decoded.tracks[i];
    EXPECT_EQ(left.rest.position, right.rest.position);
    EXPECT_EQ(left.rest.rotation.coeffs(), right.rest.rotation.coeffs());
    EXPECT_EQ(left.from, right.from);
    ASSERT_EQ(right.positions.cols(), left.positions.cols());
    for (Eigen::Index frame = 0; frame < left.positions.cols(); ++frame) {
      ASSERT_LT((left.positions.col(frame) - right.positions.col(frame)).cwiseAbs().maxCoeff(), 0.00004);
      ASSERT_LT((left.positions.col(frame) - right.positions.col(frame)).norm(), 0.0001);
      ASSERT_LT(angle_between(left.rotations.col(frame), right.rotations.col(frame)), 0.02 * kDegree);
      ASSERT_NEAR(right.rotations.col(frame).norm(), 1, 1e-12);
      if (frame > 0) {
        ASSERT_GE(right.rotations.col(frame).dot(right.rotations.col(frame - 1)), -1e-3) << frame;
      }
    }
  }
  ASSERT_EQ(decoded.events.size(), original.events.size());
  for (std::size_t i = 0; i < original.events.size(); ++i) {
    const ContactEvent &left = original.events[i], &right = decoded.events[i];
    EXPECT_EQ(left.time, right.time);
    EXPECT_EQ(left.bodies, right.bodies);
    EXPECT_NEAR(left.impulse, right.impulse, 1e-7);
    EXPECT_LT((left.position - right.position).norm(), 1e-6);
    EXPECT_LT((left.normal - right.normal).norm(), 1e-6);
  }
}

TEST(AnimationCodec, SmoothMotionComesBackWithinATenthOfAMillimetreAndOfADegree) {
  for (std::uint64_t seed = 0; seed < 20; ++seed)
    expect_round_trip(draw_animation(seed, 1 + 37 * seed, true));
}

TEST(AnimationCodec, WildMotionComesBackToo) {
  for (std::uint64_t seed = 100; seed < 120; ++seed)
    expect_round_trip(draw_animation(seed, 1 + 11 * seed, false));
}

TEST(AnimationCodec, EdgesComeBack) {
  expect_round_trip(Animation{});
  expect_round_trip(draw_animation(7, 1, true));
  Animation far = draw_animation(8, 50, true);
  far.tracks[0].positions *= 1e6;
  far.bodies[0].name = "";
  far.bodies[1].name = std::string(1000, 'x') + std::string("\0y", 2);
  expect_round_trip(far);
}

TEST(AnimationCodec, SuccessiveRotationsLieInOneHemisphere) {
  // The signs of draw_track are random; smooth ones come back without a jump.
  const Animation decoded = decode_animation(encode_animation(draw_animation(9, 300, true)));
  for (const Track& track : decoded.tracks)
    for (Eigen::Index frame = 1; frame < track.rotations.cols(); ++frame)
      ASSERT_GT(track.rotations.col(frame).dot(track.rotations.col(frame - 1)), 0.9) << frame;
}

TEST(AnimationCodec, WildRotationsComeBackInOneHemisphereThoughTheyAreRounded) {
  Animation turns = draw_animation(12, 2, true);
  Track& track = turns.tracks[0];
  // Half a turn and a bit less than a quantum: rounded it is more than half.
  RandomStream random = stream(13);
  for (int draw = 0; draw < 2000; ++draw) {
    const Eigen::Vector4d first = draw_rotation(random).coeffs(), other = draw_rotation(random).coeffs();
    track.rotations.col(0) = first;
    track.rotations.col(1) = (other - other.dot(first) * first + 1e-6 * first).normalized();
    const Rotations decoded = decode_animation(encode_animation(turns)).tracks[0].rotations;
    ASSERT_GE(decoded.col(0).dot(decoded.col(1)), 0) << draw;
  }
}

TEST(AnimationCodec, EqualAnimationsHaveEqualBytes) {
  EXPECT_EQ(encode_animation(draw_animation(10, 100, true)), encode_animation(draw_animation(10, 100, true)));
  EXPECT_NE(encode_animation(draw_animation(10, 100, true)), encode_animation(draw_animation(11, 100, true)));
}

TEST(AnimationCodec, SmoothMotionIsSmall) {
  // 4 bodies of 300 frames: 67 kB as doubles.
  EXPECT_LT(encode_animation(draw_animation(12, 300, true)).size(), 12000u);
}

// --- Damage ------------------------------------------------------------------------------------

TEST(AnimationCodec, EveryDamagedByteIsNoticed) {
  const std::string bytes = encode_animation(draw_animation(13, 60, true));
  ASSERT_GT(bytes.size(), 500u);
  std::string damaged = bytes;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    for (unsigned flip = 1; flip < 256; flip = flip < 128 ? 2 * flip : flip + 127) {
      damaged[i] = static_cast<char>(bytes[i] ^ static_cast<char>(flip));
      ASSERT_THROW(decode_animation(damaged), DamagedAnimation) << "byte " << i << " flipped by " << flip;
    }
    damaged[i] = bytes[i];
  }
  EXPECT_NO_THROW(decode_animation(damaged));
}

TEST(AnimationCodec, EveryTruncationAndExtensionIsNoticed) {
  const std::string bytes = encode_animation(draw_animation(14, 60, true));
  for (std::size_t length = 0; length < bytes.size(); ++length)
    ASSERT_THROW(decode_animation(std::string_view(bytes).substr(0, length)), DamagedAnimation) << length;
  EXPECT_THROW(decode_animation(bytes + '\0'), DamagedAnimation);
  EXPECT_THROW(decode_animation(bytes + bytes), DamagedAnimation);
}

/// `packed` compressed behind a checksum that fits, as encode_animation writes it.
std::string seal(const std::string& packed, char version = '\x03') {
  std::string compressed(ZSTD_compressBound(packed.size()), '\0');
  compressed.resize(ZSTD_compress(compressed.data(), compressed.size(), packed.data(), packed.size(), 1));
  const std::uint64_t checksum = XXH3_64bits(compressed.data(), compressed.size());
  return version + std::string(reinterpret_cast<const char*>(&checksum), sizeof checksum) + compressed;
}

std::string unseal(const std::string& bytes) {
  const std::string_view compressed = std::string_view(bytes).substr(9);
  std::string packed(ZSTD_getFrameContentSize(compressed.data(), compressed.size()), '\0');
  EXPECT_EQ(ZSTD_decompress(packed.data(), packed.size(), compressed.data(), compressed.size()),
            packed.size());
  return packed;
}

TEST(AnimationCodec, ASurfaceOfManyPointsIsSmall) {
  // Waves as high and as long as a dice table's, 60 points a side: 14 kB as floats alone.
  HeightField field{.rows = 60,
                    .columns = 60,
                    .spacing = 1.0 / 300,
                    .heights = {},
                    .attributes = {{.name = "friction", .values = {}}}};
  for (std::size_t row = 0; row < 60; ++row)
    for (std::size_t column = 0; column < 60; ++column) {
      const double wave =
          std::sin(0.7 * static_cast<double>(row)) * std::cos(0.6 * static_cast<double>(column));
      field.heights.push_back(0.0005 * wave);
      field.attributes[0].values.push_back(0.4 + 0.05 * wave);
    }
  Animation animation;
  animation.bodies.push_back({.name = "table", .shape = std::move(field), .colour = "#000000"});
  EXPECT_LT(encode_animation(animation).size(), 5000u);
}

TEST(AnimationCodec, MeshesComeBackWithinTwoMicrometres) {
  RandomStream random = stream(17);
  Mesh mesh;
  for (int i = 0; i < 300; ++i)
    mesh.positions.push_back(random.gaussian());
  Animation animation;
  animation.bodies.push_back({.name = "rock", .shape = mesh, .colour = "#000000"});
  const Animation decoded = decode_animation(encode_animation(animation));
  const auto& positions = std::get<Mesh>(decoded.bodies.at(0).shape).positions;
  ASSERT_EQ(positions.size(), mesh.positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i)
    EXPECT_NEAR(positions[i], mesh.positions[i], 2e-6);
}

TEST(AnimationCodec, RecordsOfTheFirstVersionAreRead) {
  // As version 1 wrote an animation without frames that has one mesh: floats, then indices as they are.
  ByteWriter out;
  out.put(60.0);
  out.put(std::uint32_t{0});
  out.put(std::uint32_t{1});
  out.put_text("rock");
  out.put(std::uint8_t{4});
  const std::vector<float> positions = {0, 0, 0, 1.25f, 0, 0, 0, 0.5f, -0.75f};
  out.put(static_cast<std::uint32_t>(positions.size()));
  for (const float value : positions)
    out.put(value);
  out.put(std::uint32_t{3});
  for (const int index : {0, 2, 1})
    out.put_varint(index);
  out.put_text("#a0b1c2");
  out.put(std::int32_t{-1});
  for (const double value : {0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 1.0})
    out.put(value);
  out.put(std::uint32_t{0});
  out.put(std::uint32_t{0});
  const Animation decoded = decode_animation(seal(out.bytes(), '\x01'));
  ASSERT_EQ(decoded.bodies.size(), 1u);
  expect_same_shape(Mesh{{0, 0, 0, 1.25, 0, 0, 0, 0.5, -0.75}, {0, 2, 1}}, decoded.bodies[0].shape);
  EXPECT_EQ(decoded.bodies[0].pose.position.y(), 0.5);
  EXPECT_EQ(decoded.bodies[0].surface, Surface::plain) << "it did not tell";
  EXPECT_THROW(decode_animation(seal(out.bytes(), '\x04')), DamagedAnimation);
}

/// A ball without frames, on a track if it appears somewhen, as versions wrote it: the third one tells a
/// surface and, of a track, from when on it is there.
std::string packed_ball(std::optional<std::uint8_t> surface, bool moves, std::optional<double> from) {
  ByteWriter out;
  out.put(60.0);
  out.put(std::uint32_t{0});
  out.put(std::uint32_t{1});
  out.put_text("ball");
  out.put(std::uint8_t{0});
  out.put(0.25);
  out.put_text("#a0b1c2");
  if (surface) out.put(*surface);
  out.put(std::int32_t{moves ? 0 : -1});
  if (moves) out.put(std::uint32_t{1});
  for (const double value : {0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 1.0})
    out.put(value);
  if (from) out.put(*from);
  if (!moves) out.put(std::uint32_t{0});
  out.put(std::uint32_t{0});
  return out.take();
}

TEST(AnimationCodec, RecordsOfTheSecondVersionAreReadAndTellNoSurface) {
  const Animation decoded = decode_animation(seal(packed_ball(std::nullopt, false, std::nullopt), '\x02'));
  ASSERT_EQ(decoded.bodies.size(), 1u);
  expect_same_shape(Sphere{0.25}, decoded.bodies[0].shape);
  EXPECT_EQ(decoded.bodies[0].surface, Surface::plain);
  EXPECT_EQ(decoded.bodies[0].pose.position.y(), 0.5);
}

TEST(AnimationCodec, BodiesOfTheSecondVersionAreThereFromTheStart) {
  const Animation decoded = decode_animation(seal(packed_ball(std::nullopt, true, std::nullopt), '\x02'));
  ASSERT_EQ(decoded.tracks.size(), 1u);
  EXPECT_EQ(decoded.tracks[0].from, 0);
  EXPECT_EQ(decoded.tracks[0].rest.position.y(), 0.5);
  EXPECT_THROW(decode_animation(seal(packed_ball(0, true, 1), '\x02')), DamagedAnimation);
}

TEST(AnimationCodec, ABodyThatAppearsAtNoTimeIsDamage) {
  EXPECT_EQ(decode_animation(seal(packed_ball(0, true, 1.25))).tracks.at(0).from, 1.25);
  for (const double from : {-0.5, HUGE_VAL, std::nan("")})
    EXPECT_THROW(decode_animation(seal(packed_ball(0, true, from))), DamagedAnimation) << from;
}

TEST(AnimationCodec, ASurfaceKeepsItsNumberForGoodAndOthersAreRefused) {
  constexpr std::array kNumbers = {Surface::plain,   Surface::wood,    Surface::boards,  Surface::varnished,
                                   Surface::felt,    Surface::cloth,   Surface::plastic, Surface::polished,
                                   Surface::glass,   Surface::metal,   Surface::rubber,  Surface::stone,
                                   Surface::plaster, Surface::marking, Surface::lamp,    Surface::shade};
  ASSERT_EQ(kNumbers.size(), kSurfaces);
  const auto decoded = [](std::uint8_t number) {
    return decode_animation(seal(packed_ball(number, false, std::nullopt)));
  };
  for (std::uint8_t number = 0; number < kSurfaces; ++number)
    EXPECT_EQ(decoded(number).bodies.at(0).surface, kNumbers[number]);
  EXPECT_THROW(decoded(static_cast<std::uint8_t>(kSurfaces)), DamagedAnimation);
  EXPECT_THROW(decoded(255), DamagedAnimation);
}

TEST(AnimationCodec, FuzzBehindAFittingChecksumIsReadOrRefusedButNeverCrashes) {
  const std::string packed = unseal(encode_animation(draw_animation(15, 20, true)));
  ASSERT_NO_THROW(decode_animation(seal(packed)));
  RandomStream random = stream(16);
  int refused = 0, read = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    std::string damaged = packed;
    for (std::uint64_t change = 0; change <= random.index(4); ++change) {
      const std::size_t at = random.index(damaged.size());
      switch (random.index(4)) {
        case 0:
          damaged[at] = static_cast<char>(random.index(256));
          break;
        case 1:
          damaged.replace(at, std::min<std::size_t>(4, damaged.size() - at), 4, '\xff');
          break;
        case 2:
          damaged.erase(at, 1 + random.index(40));
          break;
        case 3:
          damaged.insert(at, 1 + random.index(40), static_cast<char>(random.index(256)));
          break;
      }
      if (damaged.empty()) damaged = packed;
    }
    try {
      const Animation animation = decode_animation(seal(damaged));
      for (const Body& body : animation.bodies)
        if (body.track) {
          ASSERT_LT(*body.track, animation.tracks.size());
        }
      for (const ContactEvent& event : animation.events)
        for (const std::size_t body : event.bodies)
          ASSERT_LT(body, animation.bodies.size());
      for (const Track& track : animation.tracks)
        ASSERT_EQ(track.positions.cols(), static_cast<Eigen::Index>(animation.frames));
      ++read;
    } catch (const DamagedAnimation&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 400);
  EXPECT_GT(read, 100);
}

TEST(AnimationCodec, StatesComeBackBitForBit) {
  State state(4);
  state << 1, kAbsent, -0.0, 1e-310;
  EXPECT_TRUE(identical(decode_state(encode_state(state)), state));
  EXPECT_EQ(decode_state(encode_state(State(0))).size(), 0);
  const std::string bytes = encode_state(state);
  for (std::size_t length = 0; length < bytes.size(); ++length)
    ASSERT_THROW(decode_state(bytes.substr(0, length)), DamagedAnimation);
  EXPECT_THROW(decode_state(bytes + 'x'), DamagedAnimation);
  EXPECT_THROW(decode_state("\xff\xff\xff\xff"), DamagedAnimation);
}

TEST(AnimationCodec, ManyAbsentNumbersOfAStateTakeNoRoom) {
  State state = State::Constant(2400, kAbsent);
  RandomStream random = stream(18);
  for (Eigen::Index i = 0; i < 30; ++i)
    state[79 * i] = random.gaussian();
  const std::string bytes = encode_state(state);
  EXPECT_LT(bytes.size(), 800u) << "19 kB are plain";
  EXPECT_TRUE(identical(decode_state(bytes), state));
  for (std::size_t length = 0; length < bytes.size(); ++length)
    ASSERT_THROW(decode_state(bytes.substr(0, length)), DamagedAnimation);
  EXPECT_THROW(decode_state(bytes + 'x'), DamagedAnimation);
  // As it was written when every State was plain.
  ByteWriter plain;
  plain.put_numbers(state.data(), 2400);
  EXPECT_TRUE(identical(decode_state(plain.bytes()), state));
}

}  // namespace
}  // namespace retake::tests
