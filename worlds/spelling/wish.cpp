// See wish.h.
#include "worlds/spelling/wish.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "sampler/check.h"
#include "worlds/spelling/view.h"

namespace retake::spelling {
namespace {

using nlohmann::json;

constexpr std::size_t kLongestText = 80;  // bytes; chosen: more than the widest box has room for

/// What is wrong with a text for a box of this size, empty if nothing is.
std::string fault_of_text(const std::string& text, int columns, int rows) {
  if (const auto unknown = unknown_characters(text); !unknown.empty())
    return "has characters that the marbles have no letters for: " +
           json(unknown).dump(-1, ' ', false, json::error_handler_t::replace);
  const auto size_text = [](int width, int height) {
    return std::to_string(width) + " columns and " + std::to_string(height) + " rows";
  };
  const TextSize least = least_size(text);
  const auto pattern = lay_out(text, columns, rows);
  if (!pattern) {
    const bool fits_none = least.columns > kMostColumns;
    return "needs " + size_text(least.columns, least.rows) +
           (fits_none ? ", the largest box has " + size_text(kMostColumns, kMostRows)
                      : ", the box has " + size_text(columns, rows));
  }
  if (pattern->count() == 0) return "has nothing but spaces";
  return "";
}

/// Appends what is wrong with lines of '#' and '.' for a box of this size, each line at its place.
void find_faults_of_lines(const std::vector<std::string>& lines, int columns, int rows,
                          const std::string& pointer, std::vector<Fault>& faults) {
  if (static_cast<int>(lines.size()) != rows)
    faults.push_back({pointer, "must have a line for each of the box's " + std::to_string(rows) +
                                   " rows, got " + std::to_string(lines.size())});
  bool is_empty = true;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].find_first_not_of("#.") != std::string::npos)
      faults.push_back({append_pointer(pointer, i), "must consist of '#' and '.'"});
    else if (static_cast<int>(lines[i].size()) != columns)
      faults.push_back({append_pointer(pointer, i), "must have a mark for each of the box's " +
                                                        std::to_string(columns) + " columns, got " +
                                                        std::to_string(lines[i].size())});
    is_empty = is_empty && lines[i].find('#') == std::string::npos;
  }
  if (is_empty) faults.push_back({pointer, "must mark a bin with '#'"});
}

std::optional<BinPattern> pattern_of_text(const json& value, int columns, int rows) {
  if (!value.is_string()) return std::nullopt;
  const std::string text = value.get<std::string>();
  if (text.empty() || text.size() > kLongestText || !fault_of_text(text, columns, rows).empty())
    return std::nullopt;
  return lay_out(text, columns, rows);
}

std::optional<BinPattern> pattern_of_lines(const json& value, int columns, int rows) {
  if (!value.is_array()) return std::nullopt;
  std::vector<std::string> lines;
  for (const json& line : value) {
    if (!line.is_string()) return std::nullopt;
    lines.push_back(line.get<std::string>());
  }
  std::vector<Fault> faults;
  find_faults_of_lines(lines, columns, rows, "", faults);
  if (!faults.empty()) return std::nullopt;
  return pattern_of(lines);
}

Parameter log_lambda_parameter() {
  return {.name = "log_lambda",
          .default_value = 5.0,
          .minimum = 0,
          .maximum = 100,
          .summary =
              "What a designated bin that is not filled costs in log p_c; by default 5 up to ten balls, "
              "7.25 for 30, and on like 2 log N",
          .source = "5.3: lambda = e^5 for HI; 7.25 for ACM and its growth measured"};
}

/// Letters become capitals, so that equal wishes are equal documents, and log_lambda fits the balls.
void fit(json& term, const Parameters& model, std::string_view, std::vector<Fault>&) {
  if (const auto text = term.find("text"); text != term.end() && text->is_string())
    *text = in_capitals(text->get<std::string>());
  const auto pattern = designated_bins(term, static_cast<int>(model.integer("columns")),
                                       static_cast<int>(model.integer("rows")));
  if (pattern && !term.contains("log_lambda")) term["log_lambda"] = default_log_lambda(pattern->count());
}

/// Puts a wish without faults together; appends one if the scene has too few balls for it.
std::unique_ptr<const Term> make_wish(BinPattern pattern, const Parameters& term, const Parameters& model,
                                      std::string_view pointer, const std::string& field,
                                      std::vector<Fault>& faults) {
  if (pattern.count() > model.integer("balls")) {
    faults.push_back({std::string(pointer) + field, "needs " + std::to_string(pattern.count()) +
                                                        " balls, the model has " +
                                                        std::to_string(model.integer("balls"))});
    return nullptr;
  }
  auto box = std::make_shared<const Box>(pattern.columns, pattern.rows, Tessellation::one);
  return std::make_unique<const Wish>(std::move(box), std::move(pattern), term.number("log_lambda"), field,
                                      static_cast<std::size_t>(model.integer("balls")));
}

TermKind spell_term() {
  ParameterTable fields(
      {{.name = "text",
        .kind = Parameter::Kind::text,
        .longest = kLongestText,
        .summary = "What the balls spell, in the middle of the box: letters, digits, spaces and . "
                   ", ! ? - + : ' \" / & # * ( ) ="},
       log_lambda_parameter()});
  return {.kind = "spell",
          .summary = "The balls spell a text: every bin of its letters holds one ball, and no other bin any",
          .parameters = std::move(fields),
          .make = [](const Parameters& term, const Parameters& model, std::string_view pointer,
                     std::vector<Fault>& faults) -> std::unique_ptr<const Term> {
            const int columns = static_cast<int>(model.integer("columns"));
            const int rows = static_cast<int>(model.integer("rows"));
            const std::string place = append_pointer(pointer, "text"), text = term.text("text");
            if (std::string fault = fault_of_text(text, columns, rows); !fault.empty()) {
              faults.push_back({place, std::move(fault)});
              return nullptr;
            }
            return make_wish(*lay_out(text, columns, rows), term, model, pointer, "/text", faults);
          },
          .fit = fit,
          .sentence = [](const Parameters& term,
                         const Parameters&) { return "the marbles spell “" + term.text("text") + "”"; }};
}

TermKind bins_term() {
  ParameterTable fields(
      {{.name = "rows",
        .kind = Parameter::Kind::text_list,
        .fewest = 1,
        .most = kMostRows,
        .longest = kMostColumns,
        .summary = "The box seen from above, far row first: '#' is a designated bin, '.' any other"},
       log_lambda_parameter()});
  return {.kind = "bins",
          .summary = "Every designated bin holds one ball, and no other bin any",
          .parameters = std::move(fields),
          .make = [](const Parameters& term, const Parameters& model, std::string_view pointer,
                     std::vector<Fault>& faults) -> std::unique_ptr<const Term> {
            const std::string place = append_pointer(pointer, "rows");
            const std::vector<std::string> lines = term.text_list("rows");
            const std::size_t faults_before = faults.size();
            find_faults_of_lines(lines, static_cast<int>(model.integer("columns")),
                                 static_cast<int>(model.integer("rows")), place, faults);
            if (faults.size() > faults_before) return nullptr;
            return make_wish(pattern_of(lines), term, model, pointer, "/rows", faults);
          },
          .fit = fit,
          .sentence = [](const Parameters&, const Parameters&) -> std::string {
            return "the marbles fill the marked bins, and no other";
          }};
}

}  // namespace

std::vector<TermKind> wish_terms() {
  return {spell_term(), bins_term()};
}

std::optional<BinPattern> designated_bins(const json& constraint, int columns, int rows) {
  if (!constraint.is_object()) return std::nullopt;
  const json kind = constraint.value("kind", json());
  if (kind == "spell") return pattern_of_text(constraint.value("text", json()), columns, rows);
  if (kind == "bins") return pattern_of_lines(constraint.value("rows", json()), columns, rows);
  return std::nullopt;
}

std::optional<TextSize> box_for(const json& constraint) {
  if (!constraint.is_object() || constraint.value("kind", json()) != "spell") return std::nullopt;
  const json value = constraint.value("text", json());
  if (!value.is_string()) return std::nullopt;
  const std::string text = value.get<std::string>();
  if (text.empty() || text.size() > kLongestText || !unknown_characters(text).empty()) return std::nullopt;
  return room_for(text, kMostColumns);
}

std::optional<TextSize> box_of(const json& constraint) {
  if (!constraint.is_object() || constraint.value("kind", json()) != "bins") return std::nullopt;
  const json lines = constraint.value("rows", json());
  if (!lines.is_array() || lines.empty() || lines.size() > kMostRows) return std::nullopt;
  TextSize size{.columns = 0, .rows = static_cast<int>(lines.size())};
  for (const json& line : lines) {
    if (!line.is_string()) return std::nullopt;
    const std::size_t columns = line.get_ref<const std::string&>().size();
    if (columns > kMostColumns) return std::nullopt;
    size.columns = std::max(size.columns, static_cast<int>(columns));
  }
  return size.columns > 0 ? std::optional(size) : std::nullopt;
}

double default_log_lambda(int balls) {
  if (balls <= 10) return 5;
  return std::round(4 * (5 + 2 * std::log(balls / 10.0))) / 4;
}

Wish::Wish(std::shared_ptr<const Box> box, BinPattern pattern, double log_lambda, std::string field,
           std::size_t marbles)
    : box_(std::move(box)),
      pattern_(std::move(pattern)),
      wished_(pattern_.count()),
      log_lambda_(log_lambda),
      field_(std::move(field)),
      marbles_(marbles) {
  CHECK(pattern_.columns == box_->columns() && pattern_.rows == box_->rows() && wished_ > 0);
}

/// What each bin holds, that as many marbles take part as bins are designated, and that each ends in one.
Claims Wish::claims() const {
  Claims all;
  StateClaim ends{.from = kEnd, .to = kEnd, .regions = {}};
  for (std::size_t bin = 0; bin < pattern_.designated.size(); ++bin) {
    const bool is_designated = pattern_.designated[bin];
    all.push_back({.field = field_,
                   .demand = NumberClaim{.what = "balls in bin " + std::to_string(bin),
                                         .values = {is_designated ? 1 : 0}}});
    if (!is_designated) continue;
    const Rectangle opening = box_->opening(bin);
    ends.regions.push_back({.low = {opening.min_x, -Region::kFar, opening.min_z},
                            .high = {opening.max_x, kInBin, opening.max_z}});
  }
  all.push_back({.field = field_, .demand = std::move(ends)});
  SumClaim parts{.whats = {}, .least = 0, .most = 1, .sum = wished_};
  for (const Roster::Mover& marble : roster(marbles_).movers)
    parts.whats.push_back(takes_part(marble.name).what);
  all.push_back({.field = field_, .demand = std::move(parts)});
  return all;
}

std::vector<Measure> Wish::measures() const {
  return {{.name = "filled_bins",
           .kind = Measure::Kind::integer,
           .summary = "How many designated bins hold one ball"},
          {.name = "stray_balls",
           .kind = Measure::Kind::integer,
           .summary = "How many balls lie where they fill no designated bin"}};
}

Wish::Count Wish::count(const Animation& animation, bool is_finished) const {
  Count count;
  std::vector<int> balls(pattern_.designated.size(), 0);
  for (const Track& track : animation.tracks) {
    if (!is_finished && !track.settled) {
      ++count.underway;
      continue;
    }
    const auto bin = box_->bin_of(track.rest.position);
    if (!bin || !pattern_.designated[*bin])
      ++count.stray;
    else
      ++balls[*bin];
  }
  for (const int lie_there : balls)
    if (lie_there == 1)
      ++count.filled;
    else
      count.stray += lie_there;
  return count;
}

TermScore Wish::score(const Animation& animation, std::span<double> values) const {
  const Count said = count(animation, true);
  values[0] = said.filled;
  values[1] = said.stray;
  return {.log_density = (said.filled - wished_) * log_lambda_,
          .satisfied = said.filled == wished_ && said.stray == 0};
}

double Wish::upper_bound(const Animation& so_far) const {
  const Count said = count(so_far, false);
  return std::min(said.filled + said.underway - wished_, 0) * log_lambda_;
}

std::vector<Body> Wish::markers(const Animation&) const {
  return {designated_floors(*box_, pattern_)};
}

}  // namespace retake::spelling
