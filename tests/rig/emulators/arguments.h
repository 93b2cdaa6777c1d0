// SPDX-License-Identifier: MIT
// The command line of an emulator: options of its own, and those that all have (Faults, Picture).
#pragma once

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <initializer_list>
#include <map>
#include <string>

#include "faults.h"
#include "picture.h"

namespace rig {

class Arguments {
  public:
    // Ends the program with the usage on anything else. `flags` stand alone, `options` take a value.
    Arguments(int argc, char** argv, const char* usage, std::initializer_list<std::string> options,
              std::initializer_list<std::string> flags) {
        for (int i = 1; i < argc;) {
            if (const int n = faults.argument(argc, argv, i) + picture.argument(argc, argv, i); n > 0) {
                i += n;
                continue;
            }
            const std::string name = argv[i];
            const bool flag = std::find(flags.begin(), flags.end(), name) != flags.end();
            const bool option = std::find(options.begin(), options.end(), name) != options.end();
            if (!flag && (!option || i + 1 == argc)) {
                std::fprintf(stderr, "unexpected '%s'\n%s", argv[i], usage);
                std::exit(2);
            }
            given_[name] = flag ? "" : argv[i + 1];
            i += flag ? 1 : 2;
        }
    }

    bool has(const char* name) const { return given_.count(name) != 0; }
    std::string get(const char* name, const char* otherwise) const {
        const auto it = given_.find(name);
        return it == given_.end() ? otherwise : it->second;
    }
    int number(const char* name, int otherwise) const {
        return has(name) ? std::atoi(get(name, "").c_str()) : otherwise;
    }
    int fps() const { return std::max(1, number("--fps", 30)); }
    // VENDOR:PRODUCT in hexadecimal.
    void id(unsigned* vendor, unsigned* product) const {
        if (has("--id") && std::sscanf(get("--id", "").c_str(), "%x:%x", vendor, product) != 2) {
            std::fprintf(stderr, "--id: expected VENDOR:PRODUCT, not '%s'\n", get("--id", "").c_str());
            std::exit(2);
        }
    }

    Faults faults;
    Picture picture;

  private:
    std::map<std::string, std::string> given_;
};

}  // namespace rig
