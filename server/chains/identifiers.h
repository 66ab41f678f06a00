// Identifiers and the time of day: the only places of the daemon that ask the system for either.
// Never used inside a chain.
#pragma once

#include <cstdint>
#include <string>

namespace retake {

/// Ten random characters, for chains: 50 bits from the system's generator.
std::string random_identifier();
/// A seed for a chain whose client named none: below 2^53, so that every JSON client keeps it exactly.
std::uint64_t random_seed();
/// The first `characters` of the base32 text of SHA-256.
std::string digest_identifier(const std::string& text, std::size_t characters);
/// Milliseconds since the Unix epoch.
std::int64_t now_milliseconds();

}  // namespace retake
