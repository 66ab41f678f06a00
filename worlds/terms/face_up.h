// The term `face_up`: a side of a body ends up, such as a die's six. Paper, section 5.4.
// A world whose sampling paints the sides finds the term among its scenario's by its type.
#pragma once

#include <string>

#include "worlds/terms/terms.h"

namespace retake::terms {

/// log p_c is 0 if the face is the one whose normal points up most at the end, else minus log lambda.
class FaceUp final : public Term {
 public:
  /// Requires: a body that has the face.
  FaceUp(Roster::Mover body, int face, double log_lambda, bool reads_frames);
  const std::string& body() const { return body_.name; }
  int face() const { return face_; }

  std::vector<Measure> measures() const override {
    return {{.name = "face", .kind = Measure::Kind::integer, .summary = "The face of the body that ends up"}};
  }
  bool reads_frames() const override { return reads_frames_; }
  TermScore score(const Animation& animation, std::span<double> values) const override;
  double least_when_satisfied() const override { return 0; }
  Claims claims() const override;
  /// What has settled stays, and who takes part is known from the start.
  double upper_bound(const Animation& so_far) const override;

 private:
  Roster::Mover body_;
  int face_;
  double log_lambda_;
  bool reads_frames_;
};

/// Of some faces the one whose normal points up most when the body is turned like this; 0 if there is none.
int highest_face(const std::vector<Face>& faces, const Eigen::Quaterniond& rotation);

}  // namespace retake::terms
