// The worlds of this build: one line each, in the order in which a person should meet them.
#include "worlds/ball2d/ball2d.h"
#include "worlds/bowling/bowling.h"
#include "worlds/dice/dice.h"
#include "worlds/spelling/spelling.h"
#include "worlds/world.h"

namespace retake {

const std::vector<const World*>& worlds() {
  static const std::vector<const World*> registered = {
      &bowling::world(),
      &spelling::world(),
      &dice::world(),
      &ball2d::world(),
  };
  return registered;
}

const World* find_world(std::string_view name) {
  for (const World* world : worlds())
    if (world->name() == name) return world;
  return nullptr;
}

}  // namespace retake
