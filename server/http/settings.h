// HttpSettings and HttpCounters: what the server allows, and what it counted.
// doc/http.md. Plain values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace retake {

struct HttpSettings {
  std::string address = "127.0.0.1";
  int port = 8080;    ///< 0: the system picks one
  std::string token;  ///< bearer token that every request but /healthz must carry; empty: none
  std::vector<std::string>
      allowed_hosts;  ///< further Host names beside loopback names and the address itself
  std::vector<std::string> allowed_origins;  ///< origins that may read answers (CORS) and send unsafe methods
  std::size_t threads = 48;                  ///< connections served at once
  std::size_t most_streams = 24;             ///< of all clients; chosen: half of the threads
  std::size_t most_streams_of_client = 8;
  std::size_t most_head_bytes = 16 * 1024;
  std::size_t most_body_bytes = 1024 * 1024;
  std::size_t most_path_bytes = 512;
  double head_seconds = 5;
  double body_seconds = 10;
  double write_stall_seconds = 10;
  double idle_seconds = 15;  ///< keep-alive
  std::size_t requests_per_connection = 10'000'000;
};

struct HttpCounters {
  std::uint64_t requests = 0;
  std::map<int, std::uint64_t> by_status;
  std::uint64_t refused = 0;  ///< cut or refused by the guard
  std::uint64_t open_connections = 0;
  std::uint64_t open_streams = 0;
};

}  // namespace retake
