// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/formats/mesh/mutate.h"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <limits>

namespace vps::test {
namespace {

// Replaces std::uniform_int_distribution, whose numbers differ between standard libraries.
std::size_t below(std::size_t end, std::mt19937_64& random) {
  return end == 0 ? 0 : static_cast<std::size_t>(random() % end);
}

void flip_bytes(std::string& bytes, std::mt19937_64& random) {
  for (std::size_t n = 1 + below(4, random); n > 0; --n)
    bytes[below(bytes.size(), random)] = static_cast<char>(random());
}

void delete_chunk(std::string& bytes, std::mt19937_64& random) {
  bytes.erase(below(bytes.size(), random), 1 + below(below(8, random) == 0 ? 2000 : 8, random));
}

void insert_bytes(std::string& bytes, std::mt19937_64& random) {
  std::string more(1 + below(16, random), ' ');
  for (char& c : more)
    c = below(2, random) == 0 ? static_cast<char>(random()) : "0123456789 .-\n/{}[]\"<>"[below(22, random)];
  bytes.insert(below(bytes.size(), random), more);
}

void duplicate_chunk(std::string& bytes, std::mt19937_64& random) {
  const std::string chunk = bytes.substr(below(bytes.size(), random), 1 + below(1000, random));
  bytes.insert(below(bytes.size(), random), chunk);
}

void truncate(std::string& bytes, std::mt19937_64& random) {
  bytes.resize(1 + below(bytes.size(), random));
}

// Replaces the first number in the text after a random position, if there is one.
void replace_written_number(std::string& bytes, std::mt19937_64& random) {
  constexpr const char* kExtreme[] = {
      "1e308",  "-1e308", "1e999",      "-1",         "0",       "4294967295", "4294967296", "nan",
      "inf",    "-0",     "2147483647", "2147483648", "255",     "1e-320",     "65536",      "9223372036854775808",
      "3.4e38", "",       "1e",         "0x7f",       "99999999"};
  const auto is_digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  const auto part_of_number = [&](char c) { return is_digit(c) || c == '.' || c == '-' || c == 'e'; };
  const auto from = bytes.begin() + static_cast<std::ptrdiff_t>(below(bytes.size(), random));
  auto begin = std::find_if(from, bytes.end(), is_digit);
  while (begin != bytes.begin() && begin != bytes.end() && part_of_number(begin[-1])) --begin;
  const auto end = std::find_if_not(begin, bytes.end(), part_of_number);
  bytes.replace(begin, end, kExtreme[below(std::size(kExtreme), random)]);
}

void replace_binary_number(std::string& bytes, std::mt19937_64& random) {
  constexpr std::uint32_t kExtreme[] = {0xFFFFFFFF, 0x7FFFFFFF, 0x80000000, 0x7FC00000, 0x7F800000, 0xFF7FFFFF,
                                        0x00FFFFFF, 0x0000FFFF, 0x00000000, 0x00000001, 0x10000000, 0x40000000};
  const std::uint32_t value = kExtreme[below(std::size(kExtreme), random)];
  const std::size_t size = std::min<std::size_t>(std::size_t{1} << below(3, random), bytes.size());
  std::memcpy(bytes.data() + below(bytes.size() - size + 1, random), &value, size);
}

}  // namespace

std::string mutate(std::string bytes, std::mt19937_64& random) {
  using Mutation = void (*)(std::string&, std::mt19937_64&);
  constexpr Mutation kMutations[] = {flip_bytes,      delete_chunk, insert_bytes,           replace_written_number,
                                     duplicate_chunk, truncate,     replace_written_number, replace_binary_number};
  std::size_t mutations = below(2, random) == 0 ? 1 : 1 + below(4, random);
  for (; mutations > 0 && !bytes.empty(); --mutations) kMutations[below(std::size(kMutations), random)](bytes, random);
  return bytes;
}

}  // namespace vps::test
