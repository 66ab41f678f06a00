// Samples: listings in every order, one sample, its keyframe document, its proof.
#include <algorithm>
#include <cmath>
#include <set>

#include "server/http/representation.h"
#include "tests/server/api/shapes.h"
#include "tests/server/daemon.h"

namespace retake {
namespace {

using namespace test;

using ApiSamples = DaemonTest;
using ApiKeyframes = DaemonTest;

std::vector<std::string> ids(const std::vector<json>& samples) {
  std::vector<std::string> texts;
  for (const json& sample : samples)
    texts.push_back(sample.at("id"));
  return texts;
}

TEST_F(ApiSamples, Every_order_walks_over_every_sample_once_whatever_the_page_size) {
  const std::string scenario = daemon.add_scenario(wish_document(1, 0.2));
  daemon.add_stocked_scenario(prior_document("Another scenario's samples"), 9);
  for (const std::string& chain : daemon.add_chains(
           scenario, json::parse(R"({"count":2,"seed":4,"method":"metropolis","stop":{"samples":20}})")))
    ASSERT_EQ(daemon.wait_for_end(chain)["state"], "finished");

  const std::vector<json> oldest = daemon.samples(scenario, "oldest");
  ASSERT_EQ(oldest.size(), 40);
  const std::vector<std::string> all = ids(oldest);
  EXPECT_EQ(std::set<std::string>(all.begin(), all.end()).size(), 40);
  std::vector<std::string> newest = all;
  std::reverse(newest.begin(), newest.end());
  const std::vector<json> likely = daemon.samples(scenario, "likely");
  for (const int limit : {1, 7, 20, 39, 40, 41, 500}) {
    EXPECT_EQ(ids(daemon.samples(scenario, "oldest", limit)), all) << limit;
    EXPECT_EQ(ids(daemon.samples(scenario, "newest", limit)), newest) << limit;
    EXPECT_EQ(ids(daemon.samples(scenario, "likely", limit)), ids(likely)) << limit;
  }
  EXPECT_EQ(ids(daemon.samples(scenario, "newest", 500)), newest);

  // Within a chain, older means an earlier iteration; more likely means a larger log p.
  for (const json& chain : elements(daemon.get("/v1/scenarios/" + scenario + "/chains").json()["chains"])) {
    std::uint64_t before = 0;
    for (const json& sample : oldest) {
      if (sample["chain"] != chain["id"]) continue;
      EXPECT_GT(sample["iteration"].get<std::uint64_t>(), before);
      before = sample["iteration"];
    }
  }
  const auto log_target = [](const json& sample) {
    return sample["log_prior"].get<double>() + sample["log_constraint"].get<double>();
  };
  EXPECT_TRUE(std::is_sorted(likely.begin(), likely.end(),
                             [&](const json& a, const json& b) { return log_target(a) > log_target(b); }));
  std::vector<std::string> sorted = ids(likely), expected = all;
  std::sort(sorted.begin(), sorted.end());
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(sorted, expected);
}

TEST_F(ApiSamples, Fifty_are_listed_by_default_newest_first) {
  const std::string scenario = daemon.add_stocked_scenario(prior_document(), 60);
  const json page = daemon.get("/v1/scenarios/" + scenario + "/samples").json();
  ASSERT_EQ(page["samples"].size(), 50);
  EXPECT_TRUE(page.contains("next_cursor"));
  EXPECT_EQ(page["samples"][0]["id"], daemon.samples(scenario, "oldest").back()["id"]);
}

TEST_F(ApiSamples, A_walk_with_cursors_stays_whole_while_a_chain_adds_samples) {
  const std::string scenario = daemon.add_stocked_scenario(prior_document(), 100);
  const std::vector<std::string> before = ids(daemon.samples(scenario, "oldest"));
  daemon.add_chains(scenario, json::object());
  const std::vector<std::string> walked = ids(daemon.samples(scenario, "newest", 50));
  const std::set<std::string> unique(walked.begin(), walked.end());
  EXPECT_EQ(unique.size(), walked.size());
  for (const std::string& id : before)
    EXPECT_TRUE(unique.contains(id)) << id;
}

TEST_F(ApiSamples, A_sample_has_every_documented_field_and_its_variables) {
  const std::string scenario = daemon.add_stocked_scenario(wish_document(1, 0.1), 3);
  const std::vector<json> listed = daemon.samples(scenario);
  ASSERT_EQ(listed.size(), 3);
  for (const json& sample : listed) {
    EXPECT_EQ(differences(sample, "Sample"), "");
    EXPECT_EQ(sample["scenario"], scenario);
    EXPECT_EQ(sample["plays"], 0);
    EXPECT_GE(sample["weight"], 1);
    EXPECT_LE(sample["log_constraint"], 0);
    EXPECT_LE(std::abs(sample["measures"]["miss"].get<double>()), 0.1);
    json whole = daemon.get("/v1/samples/" + sample["id"].get<std::string>()).json();
    EXPECT_EQ(differences(whole, "Sample"), "");
    EXPECT_EQ(whole["variables"].size(), 5);
    EXPECT_TRUE(whole["variables"]["tilt_5"].is_number());
    EXPECT_EQ(whole["verifiable"], true);
    for (const char* of_one_alone : {"variables", "verifiable"})
      whole.erase(of_one_alone);
    EXPECT_EQ(whole, sample);
  }
}

TEST_F(ApiSamples, Simulating_the_stored_state_again_gives_the_same_digest) {
  const std::string scenario = daemon.add_stocked_scenario(wish_document(-1, 0.1), 5);
  for (const json& sample : daemon.samples(scenario)) {
    const Answer answer = daemon.post("/v1/samples/" + sample["id"].get<std::string>() + "/verify");
    ASSERT_EQ(answer.status, 200);
    EXPECT_EQ(differences(answer.json(), "Verified"), "");
    EXPECT_EQ(answer.json()["identical"], true);
    EXPECT_EQ(answer.json()["digest"], sample["digest"]);
    EXPECT_EQ(answer.json()["stored_digest"], sample["digest"]);
  }
}

void expect_whole_keyframes(const json& document) {
  ASSERT_EQ(differences(document, "Keyframes"), "");
  EXPECT_EQ(document["format"], "retake.keyframes/1");
  EXPECT_EQ(document["units"], json::parse(R"({"length":"m","time":"s","angle":"rad"})"));
  EXPECT_EQ(document["up"], "+y");
  EXPECT_EQ(document["handedness"], "right");
  EXPECT_EQ(document["quaternion"], "xyzw");
  const std::size_t frames = document["frames"];
  EXPECT_NEAR(document["duration"].get<double>(),
              (static_cast<double>(frames) - 1) / document["rate"].get<double>(), 1e-9);
  std::set<std::size_t> used;
  for (const json& body : document["bodies"]) {
    EXPECT_TRUE(body.contains("track") != (body.contains("position") && body.contains("rotation"))) << body;
    if (body.contains("track")) used.insert(body["track"].get<std::size_t>());
  }
  EXPECT_EQ(used.size(), document["tracks"].size());
  for (const json& track : document["tracks"]) {
    ASSERT_EQ(track["position"].size(), 3 * frames);
    ASSERT_EQ(track["rotation"].size(), 4 * frames);
    const std::vector<double> rotation = track["rotation"];
    for (std::size_t frame = 0; frame < frames; ++frame) {
      double square = 0, cosine = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        square += rotation[4 * frame + k] * rotation[4 * frame + k];
        if (frame > 0) cosine += rotation[4 * frame + k] * rotation[4 * frame - 4 + k];
      }
      EXPECT_NEAR(square, 1, 1e-4);
      EXPECT_TRUE(frame == 0 || cosine >= 0) << "frame " << frame << " leaves the hemisphere";
    }
  }
  for (const json& event : document["events"]) {
    EXPECT_EQ(event["bodies"].size(), 2);
    EXPECT_GE(event["time"], 0);
    EXPECT_LE(event["time"].get<double>(), document["duration"].get<double>() + 1e-6);
  }
}

TEST_F(ApiKeyframes, The_document_is_whole_at_its_own_rate_and_at_others) {
  const std::string scenario = daemon.add_stocked_scenario(wish_document(1, 0.1), 2);
  for (const json& sample : daemon.samples(scenario)) {
    const std::string path = "/v1/samples/" + sample["id"].get<std::string>() + "/keyframes";
    const json own = daemon.get(path).json();
    expect_whole_keyframes(own);
    EXPECT_EQ(own["sample"], sample["id"]);
    EXPECT_EQ(own["world"], "ball2d");
    EXPECT_EQ(own["world_version"], 1);
    EXPECT_EQ(own["rate"], 60);
    EXPECT_NEAR(own["duration"].get<double>(), sample["duration"].get<double>(), 1e-9);
    for (const int rate : {1, 30, 60, 240}) {
      const json other = daemon.get(path + "?rate=" + std::to_string(rate)).json();
      expect_whole_keyframes(other);
      EXPECT_EQ(other["rate"], rate);
      EXPECT_GE(other["duration"].get<double>(), own["duration"].get<double>() - 1e-9);
      EXPECT_LT(other["duration"].get<double>(), own["duration"].get<double>() + 1.0 / rate);
      // It begins and ends where the animation does, and every second frame at half the rate is one of its
      // own.
      const json& from = own["tracks"][0]["position"];
      const json& to = other["tracks"][0]["position"];
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(to[k].get<double>(), from[k].get<double>(), 1e-4);
        EXPECT_NEAR(to[to.size() - 3 + k].get<double>(), from[from.size() - 3 + k].get<double>(), 1e-4);
      }
      for (std::size_t frame = 0; rate == 30 && 2 * frame < own["frames"].get<std::size_t>(); ++frame)
        for (std::size_t k = 0; k < 3; ++k) {
          ASSERT_NEAR(to[3 * frame + k].get<double>(), from[6 * frame + k].get<double>(), 1e-4) << frame;
        }
    }
  }
}

TEST_F(ApiKeyframes, They_are_immutable_to_caches_and_known_by_a_strong_tag) {
  const std::string scenario = daemon.add_stocked_scenario(prior_document(), 2);
  const std::vector<json> samples = daemon.samples(scenario);
  const std::string path = "/v1/samples/" + samples[0]["id"].get<std::string>() + "/keyframes";
  const Answer first = daemon.get(path);
  ASSERT_EQ(first.status, 200);
  EXPECT_EQ(first.header("cache-control"), "public, max-age=31536000, immutable");
  EXPECT_EQ(first.header("content-type"), "application/json");
  const std::string etag = first.header("etag");
  ASSERT_GT(etag.size(), 2);
  EXPECT_EQ(etag.front(), '"');
  EXPECT_EQ(etag.back(), '"');

  const Answer known = daemon.get(path, {{"If-None-Match", etag}});
  EXPECT_EQ(known.status, 304);
  EXPECT_EQ(known.body, "");
  EXPECT_EQ(known.header("etag"), etag);
  EXPECT_EQ(known.header("cache-control"), "public, max-age=31536000, immutable");
  EXPECT_EQ(daemon.get(path, {{"If-None-Match", "\"another\""}}).status, 200);

  // Other content has another tag; the same content has the same one, also later.
  EXPECT_NE(daemon.get(path + "?rate=30").header("etag"), etag);
  EXPECT_NE(daemon.get("/v1/samples/" + samples[1]["id"].get<std::string>() + "/keyframes").header("etag"),
            etag);
  EXPECT_EQ(daemon.get(path).header("etag"), etag);
  EXPECT_EQ(daemon.get(path).body, first.body);
  const Answer head = daemon.ask("HEAD", path);
  EXPECT_EQ(head.status, 200);
  EXPECT_EQ(head.header("etag"), etag);
  EXPECT_EQ(head.body, "");
}

TEST_F(ApiKeyframes, They_are_compressed_for_clients_that_accept_it) {
  const std::string scenario = daemon.add_stocked_scenario(prior_document(), 1);
  const std::string path =
      "/v1/samples/" + daemon.samples(scenario)[0]["id"].get<std::string>() + "/keyframes";
  const Answer plain = daemon.get(path);
  const Answer packed = daemon.get(path, {{"Accept-Encoding", "gzip, br"}});
  EXPECT_EQ(plain.header("content-encoding"), "");
  EXPECT_EQ(packed.header("content-encoding"), "gzip");
  EXPECT_LT(packed.body.size(), plain.body.size());
  EXPECT_EQ(gunzip(packed.body), plain.body);
  EXPECT_EQ(packed.header("vary"), "Accept-Encoding");
  EXPECT_NE(packed.header("etag"), plain.header("etag"));
  EXPECT_EQ(daemon.get(path, {{"Accept-Encoding", "gzip"}, {"If-None-Match", packed.header("etag")}}).status,
            304);
  EXPECT_EQ(daemon.get(path, {{"Accept-Encoding", "gzip;q=0"}}).header("content-encoding"), "");
}

}  // namespace
}  // namespace retake
