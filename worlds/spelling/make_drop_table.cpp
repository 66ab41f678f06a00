// Writes the counts of drop_table.h, for the build.
#include <cstdio>

#include "worlds/spelling/drop_table.h"

int main() {
  for (const std::uint32_t count : retake::spelling::count_drops(retake::spelling::kCountedDrops))
    std::printf("%u,\n", count);
}
