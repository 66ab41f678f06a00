// HttpProblem: a refusal that says what was wrong; one shape for every error (RFC 9457).
// doc/api.md, "Conventions". It must not know the socket; it only builds responses.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "server/http/message.h"
#include "worlds/document.h"

namespace retake {

/// A refusal with the status of RFC 9457's problem details. Thrown by handlers.
class HttpProblem : public std::runtime_error {
 public:
  HttpProblem(int status, std::string type, std::string title, std::string detail,
              std::vector<Fault> errors = {}, std::vector<std::pair<std::string, std::string>> headers = {});
  int status;
  std::string type;  ///< short name such as "no-samples-yet"; sent as "/problems/no-samples-yet"
  std::string title;
  std::string detail;
  std::vector<Fault> errors;
  std::vector<std::pair<std::string, std::string>> headers;
  nlohmann::json more = nlohmann::json::object();  ///< further members, such as when to expect an answer
};

/// The response of a problem: application/problem+json {"type","title","status","detail","errors",...}.
HttpResponse problem_response(const HttpProblem& problem);

/// 413 of a body that has more bytes, or announces more.
HttpProblem body_too_large(std::size_t most_bytes);

/// Serialises JSON for a client; invalid UTF-8 is replaced, never thrown.
HttpResponse json_response(const nlohmann::json& body, int status = 200);

}  // namespace retake
