// parse_document: what is refused, where it is said to be wrong, and whether the text was JSON at all.
#include "worlds/document.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/worlds/fixture.h"

namespace retake::tests {
namespace {

struct Refusal {
  std::string pointer;
  bool malformed = false;
};

/// Fails unless the text is refused with exactly one fault.
Refusal refusal_of(const std::string& text) {
  try {
    parse_document(text);
  } catch (const InvalidRequest& invalid) {
    EXPECT_EQ(invalid.faults().size(), 1u) << invalid.what();
    EXPECT_FALSE(invalid.faults()[0].detail.empty());
    return {invalid.faults()[0].pointer, invalid.malformed()};
  }
  ADD_FAILURE() << "accepted: " << text.substr(0, 100);
  return {"accepted"};
}

std::string nested(int levels, const std::string& open, const std::string& close, const std::string& inside) {
  std::string text;
  for (int i = 0; i < levels; ++i)
    text += open;
  text += inside;
  for (int i = 0; i < levels; ++i)
    text += close;
  return text;
}

TEST(Document, IsReadAsItStands) {
  const std::string text =
      R"({"a":[1,2.5,-3,true,null,"\u00e9 \ud83c\udfb3"],"b":{"c":{}},"":[[],[{}]],"d/e~f":1e-3})";
  EXPECT_EQ(parse_document(text), json::parse(text));
  EXPECT_EQ(parse_document(" 5 "), json(5));
  EXPECT_EQ(parse_document("\"text\""), json("text"));
  EXPECT_EQ(parse_document("18446744073709551615"), json(18446744073709551615u));
  EXPECT_EQ(parse_document("123456789012345678901234567890").get<double>(), 123456789012345678901234567890.0);
  EXPECT_EQ(parse_document("1e-999").get<double>(), 0);
}

TEST(Document, TextThatIsNotJsonIsMalformed) {
  for (const std::string text :
       {"",      " ",     "{",     "[1,",        "{\"a\":}",  "{\"a\" 1}", "[1 2]",   "nul",
        "'a'",   "{a:1}", "[1,]",  "{\"a\":1,}", "01",        "+1",        ".5",      "1.",
        "0x10",  "NaN",   "[NaN]", "Infinity",   "-Infinity", "\"\x01\"",  "\"\\x\"", "\"\\ud800\"",
        "[1] 2", "{} {}", "{}x",   "// a\n1",    "\"abc",     "]"}) {
    const Refusal refusal = refusal_of(text);
    EXPECT_TRUE(refusal.malformed) << text;
    EXPECT_EQ(refusal.pointer, "") << text;
  }
}

TEST(Document, TextThatIsNotUtf8IsMalformed) {
  for (const std::string text : {"\"\xff\"", "\"\xc3\"", "\"\xc0\xaf\"", "\"\xed\xa0\x80\"",
                                 "\"\xf5\x80\x80\x80\"", "{\"\xe9\":1}", "\"\xe2\x82\""})
    EXPECT_TRUE(refusal_of(text).malformed) << text;
}

TEST(Document, EmbeddedNulIsMalformed) {
  EXPECT_TRUE(refusal_of(std::string("1\0", 2)).malformed);
}

TEST(Document, ThirtyTwoLevelsAreReadAndThirtyThreeRefusedAtTheirPlace) {
  EXPECT_EQ(parse_document(nested(32, "[", "]", "1")), json::parse(nested(32, "[", "]", "1")));
  EXPECT_EQ(parse_document(nested(32, "{\"a\":", "}", "1")), json::parse(nested(32, "{\"a\":", "}", "1")));
  std::string arrays, objects;
  for (int i = 0; i < 32; ++i) {
    arrays += "/0";
    objects += "/a";
  }
  const Refusal in_arrays = refusal_of(nested(33, "[", "]", "1")),
                in_objects = refusal_of(nested(33, "{\"a\":", "}", "1"));
  EXPECT_EQ(in_arrays.pointer, arrays);
  EXPECT_EQ(in_objects.pointer, objects);
  EXPECT_FALSE(in_arrays.malformed);
  EXPECT_FALSE(in_objects.malformed);
  EXPECT_EQ(refusal_of(nested(33, "[", "]", "")).pointer, arrays) << "an empty 33rd level";
}

TEST(Document, AHundredThousandLevelsAreRefusedWithoutHarm) {
  for (const bool closed : {true, false}) {
    EXPECT_FALSE(refusal_of(nested(100000, "[", closed ? "]" : "", "")).malformed);
    EXPECT_FALSE(refusal_of(nested(100000, "{\"a\":", closed ? "}" : "", closed ? "1" : "")).malformed);
  }
}

TEST(Document, DuplicateKeysAreRefusedAtTheirPlace) {
  const struct {
    std::string text, pointer;
  } cases[] = {{R"({"a":1,"a":1})", "/a"},
               {R"({"":1,"":2})", "/"},
               {R"({"x":{"b":1,"c":2,"b":3}})", "/x/b"},
               {R"([0,{"k":[{"q":1},{"p":1,"p":2}]}])", "/1/k/1/p"},
               {R"({"a/b~c":{"~/":1,"~/":2}})", "/a~1b~0c/~0~1"},
               {R"({"~1":{"m":{},"m":0}})", "/~01/m"},
               {R"({"a":{"b":[1,2,{}]},"c":[[1],[2]],"d":{"e":1},"d":2})", "/d"},
               {R"({"a":[{"b":1}],"\u0061":2})", "/a"}};
  for (const auto& [text, pointer] : cases) {
    const Refusal refusal = refusal_of(text);
    EXPECT_EQ(refusal.pointer, pointer) << text;
    EXPECT_FALSE(refusal.malformed) << text;
  }
}

TEST(Document, EqualKeysOfDifferentObjectsAreNoDuplicates) {
  EXPECT_NO_THROW(parse_document(R"({"a":{"a":{"a":1}},"b":[{"a":1},{"a":2}]})"));
}

TEST(Document, NumbersBeyondADoubleAreRefusedAtTheirPlaceThoughTheyAreJson) {
  const struct {
    std::string text, pointer;
  } cases[] = {{"1e999", ""},
               {"-1e999", ""},
               {"[0,1,1e400]", "/2"},
               {R"({"model":{"drop_height":1e999}})", "/model/drop_height"},
               {R"({"a":[{"b":1},{"c/d":[0,-1e999]}]})", "/a/1/c~1d/1"}};
  for (const auto& [text, pointer] : cases) {
    const Refusal refusal = refusal_of(text);
    EXPECT_EQ(refusal.pointer, pointer) << text;
    EXPECT_FALSE(refusal.malformed) << text;
  }
  EXPECT_NO_THROW(parse_document("1.7976931348623157e308"));
}

std::string repeated(std::size_t count, const std::string& piece) {
  std::string text = piece;
  for (std::size_t i = 1; i < count; ++i)
    text += "," + piece;
  return text;
}

TEST(Document, TenThousandValuesAreReadAndOneMoreIsRefusedWhateverItIs) {
  EXPECT_EQ(parse_document("[" + repeated(9999, "0") + "]").size(), 9999u);
  EXPECT_EQ(parse_document("[" + repeated(3333, "[1,2]") + "]").size(), 3333u);
  std::string fields;
  for (int i = 0; i < 10'000; ++i)
    fields += (i > 0 ? "," : "") + ("\"" + std::to_string(i) + "\":0");
  for (const std::string& text :
       {"[" + repeated(10'000, "0") + "]", "[" + repeated(10'000, "\"a\"") + "]",
        "[" + repeated(10'000, "null") + "]", "[" + repeated(10'000, "[]") + "]",
        "[" + repeated(10'000, "{}") + "]", "[" + repeated(3334, "{\"a\":1,\"b\":2}") + "]",
        "{" + fields + "}", "{\"a\":{" + fields + "}}", "[" + repeated(5'000'000, "0")}) {
    const Refusal refusal = refusal_of(text);
    EXPECT_EQ(refusal.pointer, "") << text.substr(0, 20);
    EXPECT_FALSE(refusal.malformed) << text.substr(0, 20);
  }
}

TEST(Document, KeysOf256BytesAreReadAndLongerOnesRefusedAtTheirObject) {
  const std::string key(256, 'k');
  EXPECT_TRUE(parse_document("{\"" + key + "\":1}").contains(key));
  EXPECT_EQ(refusal_of("{\"" + key + "k\":1}").pointer, "");
  EXPECT_EQ(refusal_of("{\"a\":[0,{\"b\":1,\"" + std::string(1 << 20, 'k') + "\":1}]}").pointer, "/a/1");
}

TEST(Document, TextsOf4096BytesAreReadAndLongerOnesRefusedAtTheirPlace) {
  const std::string text(4096, 't');
  EXPECT_EQ(parse_document("\"" + text + "\""), text);
  EXPECT_EQ(refusal_of("\"" + text + "t\"").pointer, "");
  EXPECT_EQ(refusal_of("{\"a\":[0,{\"b/c\":\"" + std::string(1 << 20, 't') + "\"}]}").pointer, "/a/1/b~1c");
}

TEST(Document, UnknownFieldsAreNamedUpToAHundredAndTheRestCounted) {
  json object = json::object();
  for (int i = 0; i < 5000; ++i)
    object["field" + std::to_string(i)] = i;
  const auto is_known = [](const std::string& name) { return name == "field7"; };
  std::vector<Fault> faults = {{"/before", "is wrong"}};
  refuse_unknown_fields(object, "/there", is_known, "is unknown", faults);
  EXPECT_LE(faults.size(), kMostFaultsListed + 1) << "as many as a client sends are held";
  EXPECT_EQ(faults[1].pointer, "/there/field0");
  faults.push_back({"/behind", "is wrong"});
  const InvalidRequest invalid(faults);
  EXPECT_EQ(invalid.faults().size(), kMostFaultsListed);
  EXPECT_EQ(invalid.further_faults(), 5001 - kMostFaultsListed);
  EXPECT_LT(std::string(invalid.what()).size(), 10'000u);
  EXPECT_EQ(InvalidRequest(std::vector<Fault>{{"", "is wrong"}}).further_faults(), 0u);
  EXPECT_EQ(InvalidRequest(std::vector<Fault>(kMostFaultsListed, Fault{"", "is wrong"})).further_faults(),
            0u);
}

TEST(Document, PointersAreEscapedAsRfc6901Asks) {
  EXPECT_EQ(append_pointer("", "a/b"), "/a~1b");
  EXPECT_EQ(append_pointer("/x", "m~n"), "/x/m~0n");
  EXPECT_EQ(append_pointer("", "~1"), "/~01");
  EXPECT_EQ(append_pointer("", ""), "/");
  EXPECT_EQ(append_pointer("/x", std::size_t{12}), "/x/12");
}

TEST(Document, AnInvalidRequestSaysEveryFault) {
  const InvalidRequest invalid({{"/a", "is wrong"}, {"/b", "is missing"}});
  EXPECT_EQ(std::string(invalid.what()), "/a: is wrong; /b: is missing");
  EXPECT_FALSE(invalid.malformed());
}

}  // namespace
}  // namespace retake::tests
