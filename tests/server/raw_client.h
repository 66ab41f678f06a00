// RawClient: sends bytes to a server of a test and reads what comes back. No HTTP library stands between.
#pragma once

#include <algorithm>
#include <arpa/inet.h>
#include <chrono>
#include <cstdlib>
#include <map>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdexcept>
#include <string>
#include <string_view>
#include <sys/socket.h>
#include <unistd.h>
#include <utility>

namespace retake::test {

struct RawResponse {
  int status = 0;  ///< 0 if none came
  std::string head;
  std::map<std::string, std::string> headers;  ///< names in lower case
  std::string body;

  std::string header(const std::string& name) const {
    const auto found = headers.find(name);
    return found == headers.end() ? "" : found->second;
  }
};

class RawClient {
 public:
  /// `source` is the address that it comes from.
  explicit RawClient(int port, int receive_buffer = 0, const char* source = "127.0.0.1")
      : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    if (receive_buffer > 0)
      setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof(receive_buffer));
    const int yes = 1;
    setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof(yes));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    inet_pton(AF_INET, source, &address.sin_addr);
    if (bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) != 0)
      throw std::runtime_error("cannot come from " + std::string(source));
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) != 0)
      throw std::runtime_error("cannot connect to the server under test");
  }
  ~RawClient() { close(); }
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;

  /// False once the server does not take more, for `seconds`.
  bool send(std::string_view data, double seconds = 5) {
    while (!data.empty()) {
      const ssize_t count = ::send(socket_, data.data(), data.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (count >= 0) {
        data.remove_prefix(static_cast<std::size_t>(count));
        continue;
      }
      if (errno != EAGAIN && errno != EWOULDBLOCK) return false;
      if (!wait(POLLOUT, seconds)) return false;
    }
    return true;
  }

  /// A response without its body, which is left to be read.
  RawResponse read_head(double seconds = 5) {
    RawResponse response;
    while (received_.find("\r\n\r\n") == std::string::npos)
      if (!receive(seconds)) return response;
    const std::size_t end = received_.find("\r\n\r\n") + 4;
    response.head = received_.substr(0, end);
    received_.erase(0, end);
    parse(response);
    return response;
  }

  /// One response, by its Content-Length, its chunks or the connection's end. `has_body` false after HEAD.
  RawResponse read(double seconds = 5, bool has_body = true) {
    RawResponse response = read_head(seconds);
    if (!has_body || response.status == 204 || response.status == 304 || response.status < 200)
      return response;
    if (response.header("transfer-encoding") == "chunked") {
      for (std::string chunk = read_chunk(seconds); !chunk.empty(); chunk = read_chunk(seconds))
        response.body += chunk;
    } else if (!response.header("content-length").empty()) {
      const auto length = static_cast<std::size_t>(std::atoll(response.header("content-length").c_str()));
      while (received_.size() < length && receive(seconds))
        continue;
      response.body = received_.substr(0, length);
      received_.erase(0, length);
    } else {
      while (receive(seconds))
        continue;
      response.body = std::exchange(received_, {});
    }
    return response;
  }

  RawResponse ask(std::string_view request, double seconds = 5) {
    send(request);
    return read(seconds, !request.starts_with("HEAD "));
  }

  /// One chunk of a chunked body; empty at its end or if none came in time.
  std::string read_chunk(double seconds = 5) {
    std::size_t line = received_.find("\r\n");
    for (; line == std::string::npos; line = received_.find("\r\n"))
      if (!receive(seconds)) return {};
    const auto size = static_cast<std::size_t>(std::strtoull(received_.c_str(), nullptr, 16));
    while (received_.size() < line + 2 + size + 2)
      if (!receive(seconds)) return {};
    ended_with_last_chunk_ = size == 0;
    std::string chunk = received_.substr(line + 2, size);
    received_.erase(0, line + 2 + size + 2);
    return chunk;
  }

  /// The last read_chunk() met the end of the body.
  bool ended_with_last_chunk() const { return ended_with_last_chunk_; }

  /// True if the server closes within `seconds`; what it still sends is dropped.
  bool is_closed_within(double seconds) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    while (std::chrono::steady_clock::now() < deadline) {
      pollfd descriptor{socket_, POLLIN, 0};
      if (poll(&descriptor, 1, static_cast<int>(std::min(50.0, seconds * 1000))) <= 0) continue;
      char bytes[4096];
      if (recv(socket_, bytes, sizeof(bytes), MSG_DONTWAIT) <= 0) return true;
    }
    return false;
  }

  void finish_sending() { shutdown(socket_, SHUT_WR); }
  /// Ends the connection with a reset instead of an orderly close.
  void reset() {
    const linger hard{1, 0};
    setsockopt(socket_, SOL_SOCKET, SO_LINGER, &hard, sizeof(hard));
    close();
  }
  void close() {
    if (socket_ >= 0) ::close(std::exchange(socket_, -1));
  }

 private:
  bool wait(short events, double seconds) {
    pollfd descriptor{socket_, events, 0};
    return poll(&descriptor, 1, static_cast<int>(seconds * 1000)) > 0;
  }
  bool receive(double seconds) {
    if (!wait(POLLIN, seconds)) return false;
    char bytes[16 * 1024];
    const ssize_t count = recv(socket_, bytes, sizeof(bytes), 0);
    if (count <= 0) return false;
    received_.append(bytes, static_cast<std::size_t>(count));
    return true;
  }
  static void parse(RawResponse& response) {
    const std::string& head = response.head;
    if (head.size() > 12) response.status = std::atoi(head.c_str() + 9);
    for (std::size_t line = head.find("\r\n") + 2; line + 2 < head.size();
         line = head.find("\r\n", line) + 2) {
      const std::size_t colon = head.find(": ", line);
      std::string name = head.substr(line, colon - line);
      std::ranges::transform(name, name.begin(),
                             [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
      response.headers[name] = head.substr(colon + 2, head.find("\r\n", line) - colon - 2);
    }
  }

  int socket_;
  std::string received_;
  bool ended_with_last_chunk_ = false;
};

/// The text of a GET request of a well-behaved client.
inline std::string get(std::string_view target, std::string_view further_fields = "") {
  return "GET " + std::string(target) + " HTTP/1.1\r\nHost: localhost\r\n" + std::string(further_fields) +
         "\r\n";
}

inline std::string post(std::string_view target, std::string_view body,
                        std::string_view further_fields = "") {
  return "POST " + std::string(target) +
         " HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n" +
         "Content-Length: " + std::to_string(body.size()) + "\r\n" + std::string(further_fields) + "\r\n" +
         std::string(body);
}

/// A POST of a body in chunks, which are given as they are sent.
inline std::string chunked(std::string_view target, std::string_view chunks,
                           std::string_view coding = "chunked") {
  return "POST " + std::string(target) +
         " HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nTransfer-Encoding: " +
         std::string(coding) + "\r\n\r\n" + std::string(chunks);
}

}  // namespace retake::test
