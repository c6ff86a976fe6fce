// SPDX-License-Identifier: BSD-3-Clause
// Prints the tables of docs/interfaces.md that are declared in core: a line `== NAME`, then rows of Markdown.
#include <iostream>

#include "core/config/strict_table.hpp"

int main() {
  using namespace backwash::config;
  std::cout << "== Vehicle file\n" << vehicle_file_keys() << "== Model file\n" << model_file_keys();
  std::cout << "== Daemon file\n" << daemon_file_keys();
  return std::cout.good() ? 0 : 1;
}
