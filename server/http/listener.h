// HttpListener: accepts connections and carries requests and answers over them. The user of cpp-httplib.
// Realises doc/http.md: the library sees a head of ours and a bounded body, never what the client sent as a
// head. It must not know routes or who may ask; that is the service's part.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/http/connection.h"
#include "server/http/head.h"
#include "server/http/message.h"
#include "server/http/problem.h"
#include "server/http/settings.h"

namespace retake {

/// What the listener asks of the server. Called from many threads.
struct HttpService {
  /// Judges a head before its body is read; a response replaces the request's answer and closes the
  /// connection. Throws: HttpProblem.
  std::function<std::optional<HttpResponse>(const RequestHead&, const std::string& remote_address)> admit;
  /// Answers a request. Never throws.
  std::function<HttpResponse(const RequestHead&, std::string body, std::string remote_address)> answer;
  /// The response of a refusal; `head` is nullptr if it could not be read. Never throws.
  std::function<HttpResponse(const RequestHead* head, const HttpProblem&)> refuse;
};

class HttpListener {
 public:
  /// `settings` and `load` must outlive it.
  HttpListener(const HttpSettings& settings, ServerLoad& load, HttpService service);
  ~HttpListener();

  /// Returns the port. Throws: std::runtime_error naming the address.
  int bind();
  /// Serves until stop(). Throws: std::runtime_error if the socket fails for good.
  void run();
  void stop();
  /// Connections that a thread serves.
  std::size_t open_connections() const;

 private:
  class Library;
  std::unique_ptr<Library> library_;
};

}  // namespace retake
