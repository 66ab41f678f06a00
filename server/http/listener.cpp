// See listener.h.
#include "server/http/listener.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <iostream>
#include <limits>
#include <malloc.h>
#include <netinet/in.h>
#include <stdexcept>
#include <sys/socket.h>
#include <unistd.h>
#include <utility>

#include <httplib.h>

#include "server/http/connection_queue.h"

namespace retake {
namespace {

constexpr int kBacklog = 128;                          ///< chosen: the library's own is 5
constexpr std::size_t kMostBufferedBodies = 12 << 20;  ///< [bytes] chosen: bodies of all requests under way
constexpr std::size_t kLarge = 256 << 10;              ///< [bytes] chosen: of a body, of which much is made
constexpr std::size_t kLargeAnswer = 1 << 20;          ///< [bytes] chosen
constexpr std::chrono::milliseconds kFairTurn{
    100};                           ///< chosen: what a connection may keep others waiting for
const char* const kOnlyPath = "/";  ///< of every head that the library sees

/// What the thread at work serves; the library's handlers know nothing but its own request.
struct Exchange {
  HttpConnection& connection;
  const RequestHead& head;
  std::string body;
  bool was_cut = false;    ///< the answer is the last on this connection
  bool was_large = false;  ///< its answer was
};
thread_local Exchange* current_exchange = nullptr;

/// What the library is given as a request: nothing that it could interpret but the method and the end. The
/// body stays with us.
std::string plain_head(const RequestHead& head, bool closes) {
  return head.method + " " + kOnlyPath + (head.is_http_1_0 ? " HTTP/1.0\r\n" : " HTTP/1.1\r\n") +
         "Content-Length: 0\r\nConnection: " + (closes ? "close\r\n\r\n" : "Keep-Alive\r\n\r\n");
}

/// What the library reads and writes. Newer versions of it ask wait_* and duration() instead of is_*.
class BoundedStream final : public httplib::Stream {
 public:
  BoundedStream(HttpConnection& connection, std::string head)
      : connection_(connection), head_(std::move(head)) {}

  bool is_readable() const { return true; }
  bool is_writable() const { return true; }
  bool wait_readable() const { return true; }
  bool wait_writable() const { return true; }
  time_t duration() const { return 0; }
  ssize_t read(char* data, size_t size) override {
    const size_t count = std::min(size, head_.size() - head_read_);
    std::memcpy(data, head_.data() + head_read_, count);
    head_read_ += count;
    return static_cast<ssize_t>(count);
  }
  ssize_t write(const char* data, size_t size) override {
    return connection_.write({data, size}) ? static_cast<ssize_t>(size) : -1;
  }
  void get_remote_ip_and_port(std::string&, int&) const override {}
  void get_local_ip_and_port(std::string&, int&) const override {}
  socket_t socket() const override { return connection_.socket(); }

 private:
  HttpConnection& connection_;
  std::string head_;
  size_t head_read_ = 0;
};

/// A whole answer as bytes, for refusals that the library has no part in.
std::string serialised(const HttpResponse& response, const std::string& reason, bool has_body) {
  std::string text = "HTTP/1.1 " + std::to_string(response.status) + " " + reason + "\r\n";
  for (const auto& [name, value] : response.headers)
    text += name + ": " + value + "\r\n";
  if (!response.content_type.empty()) text += "Content-Type: " + response.content_type + "\r\n";
  text += "Content-Length: " + std::to_string(response.body.size()) + "\r\nConnection: close\r\n\r\n";
  if (has_body) text += response.body;
  return text;
}

/// A part of a total that is counted for as long as this lives.
class Share {
 public:
  explicit Share(std::atomic<std::size_t>& total) : total_(total) {}
  ~Share() { total_ -= share_; }
  Share(const Share&) = delete;
  Share& operator=(const Share&) = delete;

  /// False if the total would be above the limit: what is refused is never counted, so that it costs nobody
  /// else his place.
  bool grow(std::size_t more, std::size_t limit = std::numeric_limits<std::size_t>::max()) {
    std::size_t before = total_.load();
    do
      if (more > 0 && (before > limit || more > limit - before)) return false;
    while (!total_.compare_exchange_weak(before, before + more));
    share_ += more;
    return true;
  }

 private:
  std::atomic<std::size_t>& total_;
  std::size_t share_ = 0;
};

/// Gives memory back to the system behind a request that took much of it, once no other large body is there;
/// the allocator would keep it for good.
class MemoryReturn {
 public:
  explicit MemoryReturn(const std::atomic<std::size_t>& buffered_bodies) : buffered_(buffered_bodies) {}
  ~MemoryReturn() {
    if (is_due && buffered_ < kLarge) malloc_trim(0);
  }
  MemoryReturn(const MemoryReturn&) = delete;
  MemoryReturn& operator=(const MemoryReturn&) = delete;
  bool is_due = false;

 private:
  const std::atomic<std::size_t>& buffered_;
};

}  // namespace

class HttpListener::Library final : public httplib::Server {
 public:
  Library(const HttpSettings& settings, ServerLoad& load, HttpService service)
      : settings_(settings), load_(load), service_(std::move(service)) {
    new_task_queue = [this] { return new ConnectionQueue(settings_.threads, load_); };
    set_tcp_nodelay(true);
    // The library's own options let a second process bind the same port.
    set_socket_options([](socket_t socket) {
      const int yes = 1;
      setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
    });
    set_handlers();
  }

  ~Library() override {
    if (!has_listened_) ::close(svr_sock_);
  }

  int bind_socket() {
    errno = 0;
    const bool any = settings_.port == 0;
    const int port = any                                               ? bind_to_any_port(settings_.address)
                     : bind_to_port(settings_.address, settings_.port) ? settings_.port
                                                                       : -1;
    if (port < 0)
      throw std::runtime_error("cannot listen on " + settings_.address + " port " +
                               std::to_string(settings_.port) +
                               (errno != 0 ? std::string(": ") + std::strerror(errno) : ""));
    ::listen(svr_sock_, kBacklog);
    return port;
  }

  void serve_connections() {
    if (load_.is_stopping) return;
    errno = 0;
    has_listened_ = true;
    listen_after_bind();
    if (!load_.is_stopping)
      throw std::runtime_error("the listening socket failed" +
                               (errno != 0 ? std::string(": ") + std::strerror(errno) : std::string()));
  }

  /// Wakes accept(), which then fails, so that listen_after_bind() returns once all requests are answered.
  void stop_accepting() {
    if (!load_.is_stopping.exchange(true)) ::shutdown(svr_sock_, SHUT_RDWR);
  }

  std::size_t open_connections() const { return open_connections_; }

 private:
  void set_handlers() {
    const Handler answer = [this](const httplib::Request&, httplib::Response& response) {
      Exchange& exchange = *current_exchange;
      put(service_.answer(exchange.head, std::move(exchange.body), exchange.connection.remote_address()),
          response);
    };
    Get(kOnlyPath, answer);
    Options(kOnlyPath, answer);
    Post(kOnlyPath, answer);
    Put(kOnlyPath, answer);
    Patch(kOnlyPath, answer);
    Delete(kOnlyPath, answer);
    // What the library thinks of by itself is not sent: no exception text, no fields that are untrue of us.
    set_exception_handler([this](const httplib::Request&, httplib::Response& response, std::exception_ptr) {
      refuse_internally(response);
    });
    set_error_handler(Handler([this](const httplib::Request&, httplib::Response& response) {
      if (!response.has_header("X-Content-Type-Options")) refuse_internally(response);
    }));
    set_post_routing_handler([this](const httplib::Request&, httplib::Response& response) {
      response.headers.erase("Keep-Alive");
      response.headers.erase("Accept-Ranges");
      if (!response.has_header("Connection")) {
        response.set_header("Connection", current_exchange->was_cut ? "close" : "keep-alive");
        if (!current_exchange->was_cut)
          response.set_header("Keep-Alive",
                              "timeout=" + std::to_string(static_cast<int>(settings_.idle_seconds)));
      }
      const bool has_no_length = response.status == 204 || response.status == 304;
      if (has_no_length) response.headers.erase("Content-Length");
    });
  }

  void refuse_internally(httplib::Response& response) {
    current_exchange->was_cut = true;
    response = httplib::Response();
    response.version = "HTTP/1.1";
    put(service_.refuse(&current_exchange->head, HttpProblem(500, "internal-error", "The server failed",
                                                             "The request could not be answered.")),
        response);
  }

  /// Hands an answer to the library.
  void put(HttpResponse from, httplib::Response& to) {
    to.status = from.status;
    for (const auto& [name, value] : from.headers)
      to.set_header(name, value);
    current_exchange->was_large = from.body.size() >= kLargeAnswer;
    if (from.stream || from.pieces) {
      put_stream(std::move(from), to);
      return;
    }
    if (!from.content_type.empty()) to.set_header("Content-Type", from.content_type);
    to.body = std::move(from.body);
  }

  void put_stream(HttpResponse from, httplib::Response& to) {
    // Nothing follows a stream; a body in pieces has an end that HTTP/1.1 can tell.
    const bool is_http_1_0 = current_exchange->head.is_http_1_0;
    current_exchange->was_cut = current_exchange->head.method != "HEAD" && (from.stream || is_http_1_0);
    const auto provider = [this, stream = std::move(from.stream), pieces = std::move(from.pieces),
                           &exchange = *current_exchange](size_t, httplib::DataSink& sink) {
      HttpConnection& connection = exchange.connection;
      if (!connection.flush()) return false;
      const StreamSink write = [&](std::string_view piece) {
        if (stream && (load_.is_stopping || connection.client_is_gone())) return false;
        return piece.empty() || sink.write(piece.data(), piece.size());
      };
      if (stream) {
        stream(write);
      } else if (!pieces(write)) {
        exchange.was_cut = true;
        return false;
      }
      sink.done();
      return true;
    };
    if (is_http_1_0)
      to.set_content_provider(from.content_type, provider);
    else
      to.set_chunked_content_provider(from.content_type, provider);
  }

  /// Called by the library for each connection, on a thread of the queue.
  bool process_and_close_socket(socket_t socket) override {
    try {
      Share counted(open_connections_);
      counted.grow(1);
      HttpConnection connection(socket, settings_, load_);
      if (ConnectionQueue::is_surplus())
        turn_away(connection);
      else
        serve(connection);
    } catch (const std::exception& error) {
      std::cerr << "retake: a connection was given up: " + std::string(error.what()) + "\n";
    }
    ::shutdown(socket, SHUT_RDWR);
    ::close(socket);
    return true;
  }

  void turn_away(HttpConnection& connection) {
    const HttpProblem busy(503, "unavailable", "The server is busy", "Too many connections wait already.", {},
                           {{"Retry-After", "2"}});
    connection.write(serialised(service_.refuse(nullptr, busy), busy.title, true));
  }

  void serve(HttpConnection& connection) {
    const auto accepted = std::chrono::steady_clock::now();
    for (std::size_t served = 0; served < settings_.requests_per_connection; ++served) {
      if (!connection.wait_for_request()) return;
      const bool keeps_others_waiting =
          load_.waiting_connections > 0 && std::chrono::steady_clock::now() - accepted > kFairTurn;
      const bool is_last =
          load_.is_stopping || keeps_others_waiting || served + 1 == settings_.requests_per_connection;
      if (!serve_request(connection, is_last)) return;
    }
  }

  /// Reads, judges and answers one request. True if a further one may follow.
  bool serve_request(HttpConnection& connection, bool is_last) {
    RequestHead head;
    bool is_read = false;
    MemoryReturn memory(buffered_bodies_);
    try {
      const std::optional<std::string> text = connection.read_head();
      if (!text) return false;
      head = parse_request_head(*text, {.most_path_bytes = settings_.most_path_bytes});
      is_read = true;
      refuse_forgotten_length(connection, head);
      if (const auto answer = service_.admit(head, connection.remote_address())) {
        close_with(connection, head, *answer, "See Other");
        return false;
      }
      Share buffered(buffered_bodies_);
      std::string body = receive_body(connection, head, buffered, memory);
      return exchange(connection, head, std::move(body), is_last || !head.keeps_alive, memory);
    } catch (const HttpProblem& problem) {
      close_with(connection, head, service_.refuse(is_read ? &head : nullptr, problem), problem.title);
      return false;
    }
  }

  /// Bytes behind a head that announces none are the next request, or a body whose length was forgotten.
  static void refuse_forgotten_length(const HttpConnection& connection, const RequestHead& head) {
    const std::string_view next = connection.unread_bytes();
    const bool is_request =
        next.empty() || next.front() == '\r' || (next.front() >= 'A' && next.front() <= 'Z');
    if (!is_request && !is_safe_method(head.method) && !head.field("content-length") && !head.is_chunked)
      throw HttpProblem(411, "length-required", "A Content-Length is required",
                        "Bytes follow the request's head, which announces none.");
  }

  /// Throws: HttpProblem.
  std::string receive_body(HttpConnection& connection, const RequestHead& head, Share& buffered,
                           MemoryReturn& memory) {
    std::size_t admitted = 0;
    const auto admit = [&](std::size_t further_bytes) {
      admitted += further_bytes;
      memory.is_due = admitted >= kLarge;
      if (!buffered.grow(further_bytes, kMostBufferedBodies))
        throw HttpProblem(503, "unavailable", "The server is busy", "Too many bodies are being received.", {},
                          {{"Retry-After", "2"}});
    };
    admit(head.content_length);
    if (head.expects_continue && connection.unread_bytes().empty() &&
        !connection.write("HTTP/1.1 100 Continue\r\n\r\n"))
      throw HttpProblem(400, "bad-request", "The request is malformed", "The client left.");
    return head.is_chunked ? connection.read_chunked_body(admit) : connection.read_body(head.content_length);
  }

  void close_with(HttpConnection& connection, const RequestHead& head, const HttpResponse& response,
                  const std::string& reason) {
    if (connection.write(serialised(response, reason, head.method != "HEAD"))) connection.close_gently();
  }

  /// Lets the library call the handlers and write the answer.
  bool exchange(HttpConnection& connection, const RequestHead& head, std::string body, bool closes,
                MemoryReturn& memory) {
    Exchange exchange{connection, head, std::move(body)};
    current_exchange = &exchange;
    connection.begin_response();
    BoundedStream stream(connection, plain_head(head, closes));
    const bool is_written = let_library_process(*this, stream, closes) && connection.flush();
    current_exchange = nullptr;
    memory.is_due |= exchange.was_large;
    if (!is_written) return false;
    if (!closes && !exchange.was_cut) return true;
    connection.close_gently();
    return false;
  }

  /// Newer versions of the library take the addresses as well.
  template <typename Server>
  static bool let_library_process(Server& server, httplib::Stream& stream, bool closes) {
    bool is_closed = false;
    const std::function<void(httplib::Request&)> nothing;
    if constexpr (requires { server.process_request(stream, closes, is_closed, nothing); })
      return server.process_request(stream, closes, is_closed, nothing);
    else
      return server.process_request(stream, "", 0, "", 0, closes, is_closed, nothing);
  }

  const HttpSettings& settings_;
  ServerLoad& load_;
  const HttpService service_;
  bool has_listened_ = false;  ///< from then on the library closes the socket
  std::atomic<std::size_t> open_connections_{0};
  std::atomic<std::size_t> buffered_bodies_{0};
};

HttpListener::HttpListener(const HttpSettings& settings, ServerLoad& load, HttpService service)
    : library_(std::make_unique<Library>(settings, load, std::move(service))) {}
HttpListener::~HttpListener() = default;
int HttpListener::bind() {
  return library_->bind_socket();
}
void HttpListener::run() {
  library_->serve_connections();
}
void HttpListener::stop() {
  library_->stop_accepting();
}
std::size_t HttpListener::open_connections() const {
  return library_->open_connections();
}

}  // namespace retake
