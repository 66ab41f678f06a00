// See identifiers.h.
#include "server/chains/identifiers.h"

#include <array>
#include <chrono>
#include <openssl/sha.h>
#include <random>

namespace retake {
namespace {

constexpr char kAlphabet[] = "abcdefghjkmnpqrstvwxyz0123456789";  // 32 characters that are hard to confuse

}  // namespace

std::string random_identifier() {
  std::random_device device;
  std::string text;
  for (int i = 0; i < 10; ++i)
    text += kAlphabet[device() % 32];
  return text;
}

std::uint64_t random_seed() {
  std::random_device device;
  return ((static_cast<std::uint64_t>(device()) << 32) | device()) >> 11;
}

std::string digest_identifier(const std::string& text, std::size_t characters) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> hash;
  SHA256(reinterpret_cast<const unsigned char*>(text.data()), text.size(), hash.data());
  std::string identifier;
  unsigned bits = 0, count = 0;
  for (const unsigned char byte : hash) {
    if (identifier.size() == characters) break;
    bits = (bits << 8) | byte;
    for (count += 8; count >= 5 && identifier.size() < characters; count -= 5)
      identifier += kAlphabet[(bits >> (count - 5)) & 31];
    bits &= (1u << count) - 1;
  }
  return identifier;
}

std::int64_t now_milliseconds() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace retake
