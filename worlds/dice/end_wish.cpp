// See end_wish.h.
#include "worlds/dice/end_wish.h"

#include <algorithm>
#include <string>

#include "sampler/check.h"
#include "worlds/dice/throw.h"
#include "worlds/dice/total.h"
#include "worlds/dice/view.h"
#include "worlds/terms/face_up.h"
#include "worlds/terms/rest_position.h"

namespace retake::dice {

std::vector<EndWish> end_wishes(const Terms& wishes, std::size_t dice) {
  std::vector<EndWish> all(dice);
  const auto wish_of = [&](const std::string& body) -> EndWish& {
    for (std::size_t die = 0; die < dice; ++die)
      if (die_name(die) == body) return all[die];
    CHECK(false, body);
    return all[0];
  };
  for (const auto& term : wishes) {
    if (const auto* rests = dynamic_cast<const terms::RestPosition*>(term.get())) {
      const auto& place = rests->place();
      EndWish& wish = wish_of(place.body);
      if (!wish.place) wish.place = {.x = place.x, .z = place.z, .radius = place.tolerance};
    }
    if (const auto* shows = dynamic_cast<const terms::FaceUp*>(term.get())) {
      EndWish& wish = wish_of(shows->body());
      if (!wish.face) wish.face = shows->face();
    }
  }
  return all;
}

std::optional<int> total_wish(const Terms& wishes) {
  for (const auto& term : wishes)
    if (const auto sum = total_of(*term)) return sum;
  return std::nullopt;
}

EndMeasures end_measures(std::size_t dice) {
  const std::vector<Measure> measures = throw_measures(dice);
  const auto index_of = [&](const std::string& name) {
    const std::string of_first = dice == 1 ? name : name + "_1";
    const auto found = std::find_if(measures.begin(), measures.end(),
                                    [&](const Measure& measure) { return measure.name == of_first; });
    return static_cast<std::size_t>(found - measures.begin());
  };
  return {.top_face = index_of("top_face"), .rest_x = index_of("rest_x"), .rest_z = index_of("rest_z")};
}

}  // namespace retake::dice
