// Where an Animation has the bodies of a Roster: tracks by their names, contacts by who is touched.
// doc/design.md, section 4. It must not know which world it is of.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "worlds/animation.h"
#include "worlds/claim.h"
#include "worlds/document.h"
#include "worlds/roster.h"

namespace retake::terms {

/// Null, and a fault at `pointer`, if the roster has no mover of that name.
const Roster::Mover* find_mover(const Roster& roster, const std::string& name, const std::string& pointer,
                                std::vector<Fault>& faults);

/// The track of a name; null if that body takes no part in the animation.
const Track* find_track(const Animation& animation, std::string_view name);

/// A body of a roster or any of them, to be found in contact events.
class Partner {
 public:
  /// Appends a fault at `pointer` if the roster has no body of that name, mover or still.
  static Partner read(const Roster& roster, const std::string& name, const std::string& pointer,
                      std::vector<Fault>& faults);

  /// In this animation: which of Animation::bodies it is, no body at all, or any.
  class Here {
   public:
    bool is(std::size_t body) const { return any_ || body == body_; }

   private:
    friend class Partner;
    bool any_ = false;
    std::optional<std::size_t> body_{};
  };
  Here in(const Animation& animation) const;
  /// The name of a mover; empty if it is none, or any body.
  const std::string& mover() const { return mover_; }
  const std::string& name() const { return name_; }

 private:
  std::string name_ = kAnyBody;
  std::string mover_{};                 ///< empty if it is none
  std::optional<std::size_t> still_{};  ///< which of Roster::still; neither: any body
};

/// The two as Term::meetings() names them; none unless both are movers.
std::vector<std::pair<std::string, std::string>> meeting(const Partner& one, const Partner& other);

/// The two in alphabetical order.
Touch touch_of(const Partner& one, const Partner& other);
/// That the movers among the two take part.
void claim_parts(const Partner& one, const Partner& other, const std::string& field, Claims& claims);

/// When a body touches another one [s], in order of time: the contacts so far that are not softer than an
/// impulse [N s].
std::vector<double> contact_times(const Animation& animation, const Partner& body, const Partner& with,
                                  double least_impulse);

}  // namespace retake::terms
