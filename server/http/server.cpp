// See server.h.
#include "server/http/server.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <iostream>
#include <new>
#include <stdexcept>
#include <utility>

#include "server/http/clients.h"
#include "server/http/guard.h"
#include "server/http/listener.h"
#include "server/http/problem.h"
#include "server/http/representation.h"
#include "server/http/route_table.h"

namespace retake {
namespace {

constexpr int kStatusCount = 600;  ///< statuses are below this

/// One line on stderr, whatever the text holds.
void log_failure(const HttpRequest& request, std::string_view kind, std::string_view what) {
  std::string line = "retake: " + request.method + " " + request.path + ": " + std::string(kind) + ": ";
  line += what;
  std::ranges::replace_if(
      line, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }, ' ');
  std::cerr << line + "\n";
}

HttpRequest to_request(const RequestHead& head, std::string body, std::string remote_address) {
  HttpRequest request;
  request.method = head.method;
  request.path = head.path;
  request.query = head.query;
  for (const auto& [name, value] : head.fields)
    request.headers[name] = value;
  request.body = std::move(body);
  request.remote_address = std::move(remote_address);
  return request;
}

/// "1,234,567".
std::string grouped(std::size_t number) {
  std::string text = std::to_string(number);
  for (std::size_t place = text.size(); place > 3; place -= 3)
    text.insert(place - 3, ",");
  return text;
}

HttpProblem unavailable_problem(std::string detail) {
  return HttpProblem(503, "unavailable", "The server cannot do this now", std::move(detail), {},
                     {{"Retry-After", "5"}});
}

HttpProblem invalid_problem(const InvalidRequest& invalid) {
  if (invalid.malformed())
    return HttpProblem(400, "invalid-request", "The document cannot be read",
                       "The body is not a JSON document.", invalid.faults());
  const std::string more = invalid.further_faults() > 0
                               ? " The first " + std::to_string(invalid.faults().size()) +
                                     " faults are listed, and " + grouped(invalid.further_faults()) +
                                     " more were found."
                               : "";
  return HttpProblem(422, "invalid-request", "The document is not valid",
                     "The request says something that is not possible." + more, invalid.faults());
}

/// Runs a handler and turns whatever it throws into a problem.
HttpResponse call(const HttpHandler& handler, const HttpRequest& request,
                  const HttpServer::Explain& explain) {
  try {
    return handler(request);
  } catch (const HttpProblem& problem) {
    return problem_response(problem);
  } catch (const InvalidRequest& invalid) {
    return problem_response(invalid_problem(invalid));
  } catch (const std::runtime_error& error) {
    if (explain)
      if (const auto problem = explain(error)) return problem_response(*problem);
    log_failure(request, "unavailable", error.what());
    return problem_response(
        unavailable_problem("Something that the server depends on failed; try again later."));
  } catch (const std::bad_alloc& error) {
    log_failure(request, "unavailable", error.what());
    return problem_response(unavailable_problem("The server is short of memory; try again later."));
  } catch (const std::exception& error) {
    log_failure(request, "internal error", error.what());
  } catch (...) {
    log_failure(request, "internal error", "of an unknown kind");
  }
  return problem_response(
      HttpProblem(500, "internal-error", "The server failed", "The request could not be answered."));
}

}  // namespace

class HttpServer::Implementation {
 public:
  explicit Implementation(HttpSettings settings)
      : settings_(std::move(settings)),
        guard_(settings_),
        streams_(settings_.most_streams_of_client, settings_.most_streams),
        listener_(settings_, load_, service()) {}

  HttpService service() {
    return {
        .admit = [this](const RequestHead& head, const std::string& remote) { return admit(head, remote); },
        .answer = [this](const RequestHead& head, std::string body,
                         std::string remote) { return answer(head, std::move(body), std::move(remote)); },
        .refuse = [this](const RequestHead* head,
                         const HttpProblem& problem) { return refuse(head, problem); }};
  }

  std::optional<HttpResponse> admit(const RequestHead& head, const std::string& remote_address) {
    std::optional<HttpResponse> response = guard_.admit(head, remote_address);
    if (response) finish(&head, *response);
    return response;
  }

  HttpResponse answer(const RequestHead& head, std::string body, std::string remote_address) {
    HttpRequest request = to_request(head, std::move(body), std::move(remote_address));
    HttpResponse response = routed(head, request);
    try {
      if (response.stream) limit_stream(request, response);
      if (response.pieces) guard_pieces(request, response);
      finish(&head, response);
    } catch (const std::exception& error) {
      log_failure(request, "internal error", error.what());
      response = problem_response(
          HttpProblem(500, "internal-error", "The server failed", "The request could not be answered."));
      finish(&head, response);
    }
    return response;
  }

  HttpResponse refuse(const RequestHead* head, const HttpProblem& problem) {
    ++refused_;
    HttpResponse response = problem_response(problem);
    finish(head, response);
    return response;
  }

  HttpCounters counters() const {
    HttpCounters counters;
    for (std::size_t status = 0; status < by_status_.size(); ++status)
      if (const std::uint64_t count = by_status_[status]) {
        counters.by_status[static_cast<int>(status)] = count;
        counters.requests += count;
      }
    counters.refused = refused_;
    counters.open_connections = listener_.open_connections() + load_.waiting_connections;
    counters.open_streams = streams_.count();
    return counters;
  }

  Explain explain;
  RouteTable& routes() { return routes_; }
  HttpListener& listener() { return listener_; }

 private:
  HttpResponse routed(const RequestHead& head, HttpRequest& request) {
    RouteTable::Match match = routes_.match(request.method, request.path);
    if (request.path == "*") match.allowed_methods = "GET, HEAD, POST, PUT, PATCH, DELETE, OPTIONS";
    if (match.handler) {
      request.path_values = std::move(match.path_values);
      return call(*match.handler, request, explain);
    }
    if (match.allowed_methods.empty())
      return problem_response(
          HttpProblem(404, "not-found", "Not found", "There is nothing at this address."));
    if (request.method != "OPTIONS")
      return problem_response(HttpProblem(405, "method-not-allowed", "The method is not allowed",
                                          "This address answers to " + match.allowed_methods + ".", {},
                                          {{"Allow", match.allowed_methods}}));
    HttpResponse options;
    options.status = 204;
    options.content_type.clear();
    options.headers = {{"Allow", match.allowed_methods}};
    if (is_preflight(head) && guard_.allowed_origin(head)) {
      options.headers.emplace_back("Access-Control-Allow-Methods", match.allowed_methods);
      options.headers.emplace_back("Access-Control-Allow-Headers",
                                   "Authorization, Content-Type, Idempotency-Key, If-None-Match");
      options.headers.emplace_back("Access-Control-Max-Age", "600");
    }
    return options;
  }

  HttpProblem streams_problem(ClientPlaces::Refusal refusal) const {
    const std::string title = "Too many streams are open";
    if (refusal == ClientPlaces::Refusal::client_has_many)
      return HttpProblem(429, "too-many-streams", title,
                         "A client may have " + std::to_string(settings_.most_streams_of_client) +
                             " streams; close one or try again later.",
                         {}, {{"Retry-After", "5"}});
    return HttpProblem(503, "too-many-streams", title, "Other clients hold all streams; try again later.", {},
                       {{"Retry-After", "5"}});
  }

  /// Counts a stream for as long as its response lives, or refuses it; HEAD asks for the head of one only.
  void limit_stream(const HttpRequest& request, HttpResponse& response) {
    if (request.method == "HEAD") {
      response.stream = [](const StreamSink&) {};
      return;
    }
    const ClientPlaces::Taken taken = streams_.take(client_at(request.remote_address));
    if (taken.refusal != ClientPlaces::Refusal::none) {
      response = problem_response(streams_problem(taken.refusal));
      return;
    }
    response.stream = [stream = std::move(response.stream), place = taken.place,
                       request](const StreamSink& sink) {
      try {
        stream(sink);
      } catch (const std::exception& error) {
        log_failure(request, "a stream ended early", error.what());
      }
    };
  }

  /// What is thrown while a body is written cuts it short, and is told to nobody but the log.
  static void guard_pieces(const HttpRequest& request, HttpResponse& response) {
    response.pieces = [pieces = std::move(response.pieces), request](const StreamSink& sink) {
      try {
        return pieces(sink);
      } catch (const std::exception& error) {
        log_failure(request, "a body was cut short", error.what());
        return false;
      }
    };
  }

  /// Gives a response the form that is sent, and counts it.
  void finish(const RequestHead* head, HttpResponse& response) {
    Preferences preferences;
    preferences.varies_by_origin = guard_.allows_origins();
    if (head) {
      preferences.method = head->method;
      preferences.if_none_match = head->list_field("if-none-match");
      preferences.accept_encoding = head->list_field("accept-encoding");
      preferences.allowed_origin = guard_.allowed_origin(*head);
    }
    represent(preferences, response);
    if (response.status >= 0 && response.status < kStatusCount)
      ++by_status_[static_cast<std::size_t>(response.status)];
  }

  const HttpSettings settings_;
  HttpGuard guard_;
  RouteTable routes_;
  ServerLoad load_;
  std::array<std::atomic<std::uint64_t>, kStatusCount> by_status_{};
  std::atomic<std::uint64_t> refused_{0};
  ClientPlaces streams_;
  HttpListener listener_;
};

HttpServer::HttpServer(HttpSettings settings)
    : implementation_(std::make_unique<Implementation>(std::move(settings))) {}
HttpServer::~HttpServer() = default;

void HttpServer::route(std::string_view method, std::string_view pattern, HttpHandler handler) {
  implementation_->routes().add(method, pattern, std::move(handler));
}
void HttpServer::explain(Explain explain) {
  implementation_->explain = std::move(explain);
}
std::vector<std::pair<std::string, std::string>> HttpServer::routes() const {
  return implementation_->routes().list();
}
int HttpServer::bind() {
  return implementation_->listener().bind();
}
void HttpServer::run() {
  implementation_->listener().run();
}
void HttpServer::stop() {
  implementation_->listener().stop();
}
HttpCounters HttpServer::counters() const {
  return implementation_->counters();
}

}  // namespace retake
