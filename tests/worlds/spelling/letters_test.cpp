// The dot face of spelling balls: the paper's two words, every character, layout and refusals.
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "worlds/spelling/letters.h"

namespace retake::spelling {
namespace {

using Lines = std::vector<std::string>;

constexpr const char* kCharacters = " ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.,!?-+:'\"/&#*()=";

Lines laid_out(std::string_view text, int columns, int rows) {
  const auto pattern = lay_out(text, columns, rows);
  return pattern ? pattern->lines() : Lines{};
}

TEST(SpellingLetters, TwoWordsLieInTheirBoxesAsThePaperCountsThem) {
  EXPECT_EQ(laid_out("HI", 7, 5), (Lines{".......",  //
                                         ".#.#.#.",  //
                                         ".###.#.",  //
                                         ".#.#.#.",  //
                                         "......."}));
  EXPECT_EQ(lay_out("HI", 7, 5)->count(), 10);
  EXPECT_EQ(laid_out("ACM", 15, 7), (Lines{"...............",  //
                                           "..#...##.#...#.",  //
                                           ".#.#.#...##.##.",  //
                                           ".###.#...#.#.#.",  //
                                           ".#.#.#...#...#.",  //
                                           ".#.#..##.#...#.",  //
                                           "..............."}));
  EXPECT_EQ(lay_out("ACM", 15, 7)->count(), 30);
}

TEST(SpellingLetters, ALongWordOfMoreThanEightyBallsFitsTheLargestLetterBox) {
  const auto pattern = lay_out("HOMEMADE", 40, 7);
  ASSERT_TRUE(pattern);
  EXPECT_EQ(pattern->count(), 85);
}

TEST(SpellingLetters, EveryCharacterOfTheFaceIsAnotherPattern) {
  std::map<Lines, char> tall, low;
  for (const char character : std::string(kCharacters)) {
    ASSERT_TRUE(unknown_characters(std::string(1, character)).empty()) << character;
    // A character between two dots, so that its place shows.
    const std::string text = {'.', character, '.'};
    const auto [at, is_new] = tall.emplace(laid_out(text, 12, 7), character);
    EXPECT_TRUE(is_new) << character << " looks like " << at->second;
    EXPECT_FALSE(at->first.empty()) << character;
    if (const Lines three = laid_out(text, 12, 3); !three.empty()) {
      const auto [other, is_new_too] = low.emplace(three, character);
      EXPECT_TRUE(is_new_too) << character << " looks like " << other->second << " in three rows";
    }
  }
  EXPECT_EQ(tall.size(), std::string(kCharacters).size());
  for (char letter = 'A'; letter <= 'Z'; ++letter)
    EXPECT_FALSE(laid_out(std::string(1, letter), 5, 3).empty()) << letter << " has no form in three rows";
}

TEST(SpellingLetters, SmallLettersAreWrittenAsCapitals) {
  EXPECT_EQ(in_capitals("Ab c!z"), "AB C!Z");
  EXPECT_EQ(laid_out("acm", 15, 7), laid_out("ACM", 15, 7));
  EXPECT_TRUE(unknown_characters("aZ9").empty());
}

TEST(SpellingLetters, UnknownCharactersAreNamedOnceAndWhole) {
  EXPECT_EQ(unknown_characters("H\xc3\xa9llo @ \xc3\xa9@$"), (Lines{"\xc3\xa9", "@", "$"}));
  EXPECT_EQ(unknown_characters("\n"), (Lines{"\n"}));
}

TEST(SpellingLetters, ATextGoesInTheTallerFaceThatLeavesAMarginElseTheTallerThatFits) {
  const auto height = [](const Lines& lines) {
    int rows = 0;
    for (const std::string& line : lines)
      rows += line.find('#') != std::string::npos ? 1 : 0;
    return rows;
  };
  EXPECT_EQ(height(laid_out("HI", 9, 7)), 5);
  EXPECT_EQ(height(laid_out("HI", 9, 6)), 3);
  EXPECT_EQ(height(laid_out("HI", 9, 5)), 3);
  EXPECT_EQ(height(laid_out("HI", 9, 4)), 3);
  EXPECT_EQ(height(laid_out("HI", 9, 3)), 3);
  EXPECT_EQ(height(laid_out("H2", 9, 5)), 5) << "digits have five rows";
  EXPECT_EQ(height(laid_out("HI", 6, 7)), 3) << "in five rows an I has feet";
}

TEST(SpellingLetters, WhatDoesNotFitIsRefusedWithTheSizeThatItNeeds) {
  EXPECT_FALSE(lay_out("ACM", 12, 7));
  EXPECT_FALSE(lay_out("HI", 7, 2));
  EXPECT_FALSE(lay_out("H2", 7, 4));
  for (const std::string text : {"ACM", "HI", "H2", "WOW!", "I"}) {
    const TextSize least = least_size(text);
    EXPECT_TRUE(lay_out(text, least.columns, least.rows)) << text;
    EXPECT_FALSE(lay_out(text, least.columns - 1, least.rows)) << text;
    EXPECT_FALSE(lay_out(text, least.columns, least.rows - 1)) << text;
  }
  EXPECT_EQ(least_size("HI").columns, 5);
  EXPECT_EQ(least_size("HI").rows, 3);
  EXPECT_EQ(least_size("H2").rows, 5);
}

TEST(SpellingLetters, PatternsAndTheirLinesAreOneThing) {
  const Lines lines = {"#.#.###", ".......", "###.#.#"};
  const BinPattern pattern = pattern_of(lines);
  EXPECT_EQ(pattern.columns, 7);
  EXPECT_EQ(pattern.rows, 3);
  EXPECT_EQ(pattern.count(), 10);
  EXPECT_EQ(pattern.lines(), lines);
  EXPECT_TRUE(pattern.designated[pattern.index(2, 2)]);
  EXPECT_FALSE(pattern.designated[pattern.index(1, 0)]);
}

}  // namespace
}  // namespace retake::spelling
