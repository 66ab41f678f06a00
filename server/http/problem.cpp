// See problem.h.
#include "server/http/problem.h"

#include <utility>

namespace retake {
namespace {

std::string serialised(const nlohmann::json& body) {
  return body.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

HttpProblem::HttpProblem(int status_, std::string type_, std::string title_, std::string detail_,
                         std::vector<Fault> errors_,
                         std::vector<std::pair<std::string, std::string>> headers_)
    : std::runtime_error(title_ + ": " + detail_),
      status(status_),
      type(std::move(type_)),
      title(std::move(title_)),
      detail(std::move(detail_)),
      errors(std::move(errors_)),
      headers(std::move(headers_)) {}

HttpResponse problem_response(const HttpProblem& problem) {
  nlohmann::json errors = nlohmann::json::array();
  for (const Fault& fault : problem.errors)
    errors.push_back({{"pointer", fault.pointer}, {"detail", fault.detail}});
  HttpResponse response;
  response.status = problem.status;
  response.content_type = "application/problem+json";
  nlohmann::json body = {{"type", "/problems/" + problem.type},
                         {"title", problem.title},
                         {"status", problem.status},
                         {"detail", problem.detail},
                         {"errors", std::move(errors)}};
  body.update(problem.more);
  response.body = serialised(body);
  response.headers = problem.headers;
  return response;
}

HttpProblem body_too_large(std::size_t most_bytes) {
  return HttpProblem(413, "content-too-large", "The body is too large",
                     "A body may have " + std::to_string(most_bytes) + " bytes.");
}

HttpResponse json_response(const nlohmann::json& body, int status) {
  HttpResponse response;
  response.status = status;
  response.body = serialised(body);
  return response;
}

}  // namespace retake
