// Measure: sets of integers go into a Score's double and come back exactly.
#include "worlds/measure.h"

#include <vector>

#include <gtest/gtest.h>

namespace retake::tests {
namespace {

TEST(Measure, SetsComeBackInAscendingOrder) {
  EXPECT_EQ(members_of(set_of(std::vector<int>{})), std::vector<int>{});
  EXPECT_EQ(members_of(set_of(std::vector<int>{10, 0, 7, 7})), (std::vector<int>{0, 7, 10}));
  std::vector<int> every;
  for (int member = 0; member <= kLargestMember; ++member) {
    every.push_back(member);
    EXPECT_EQ(members_of(set_of(std::vector<int>{member})), std::vector<int>{member});
    EXPECT_EQ(members_of(set_of(every)), every);
  }
}

TEST(Measure, TheSetWithoutMembersIsZeroAndNotNone) {
  EXPECT_EQ(set_of(std::vector<int>{}), 0);
  EXPECT_EQ(set_of(std::vector<int>{0, 2}), 5);
}

TEST(MeasureDeathTest, WhatADoubleCannotHoldIsRefused) {
  EXPECT_DEATH(set_of(std::vector<int>{kLargestMember + 1}), "member");
  EXPECT_DEATH(set_of(std::vector<int>{-1}), "member");
}

}  // namespace
}  // namespace retake::tests
