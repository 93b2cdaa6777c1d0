// SPDX-License-Identifier: MIT
// burin devices: the sensors that are plugged in, and what can be done about those that cannot be opened.
#include "burin/capture.h"
#include "cli/common.h"

namespace burin::cli {
namespace {

const char* access_name(std::uint32_t access) {
    constexpr const char* kNames[] = {"ready", "busy", "denied", "unsupported"};
    return access < 4 ? kNames[access] : "unknown";
}

int list_devices(bool json) {
    std::vector<burin_device> devices(16);
    std::uint64_t count = 0;
    burin_status status;
    while ((status = burin_devices(devices.data(), devices.size(), &count)) == BURIN_INSUFFICIENT_MEMORY)
        devices.resize(count + 4);  // one may be plugged in meanwhile
    if (status != BURIN_OK) return complain(kFailed, burin_source_error({0, 0}));
    devices.resize(count);
    nlohmann::json list = nlohmann::json::array(), backends = nlohmann::json::array();
    for (const burin_device& d : devices) {
        list.push_back({{"address", d.address},
                        {"name", d.name},
                        {"serial", d.serial},
                        {"location", d.location},
                        {"driver", d.driver},
                        {"formats", d.formats},
                        {"access", access_name(d.access)},
                        {"hint", d.hint}});
        if (json) continue;
        std::printf("%-28s %s\n", d.address, d.name);
        const std::pair<const char*, const char*> facts[] = {{"serial", d.serial},
                                                             {"plugged in at", d.location},
                                                             {"kernel driver", d.driver},
                                                             {"formats", d.formats}};
        for (const auto& [what, fact] : facts)
            if (*fact) std::printf("    %s: %s\n", what, fact);
        if (d.access != BURIN_DEVICE_READY) std::printf("    %s: %s\n", access_name(d.access), d.hint);
    }
    for (std::uint32_t i = 0; i < burin_backend_count(); ++i) {
        char name[32], about[160], problem[512];
        if (burin_backend(i, name, sizeof name, about, sizeof about, problem, sizeof problem) != BURIN_OK)
            continue;
        backends.push_back({{"name", name}, {"about", about}, {"problem", problem}});
        if (!json && *problem) std::printf("%s: (%s) cannot list: %s\n", name, about, problem);
    }
    if (json) std::printf("%s\n", nlohmann::json({{"devices", list}, {"backends", backends}}).dump().c_str());
    return kDone;
}

}  // namespace

void add_devices(CLI::App& app, int* exit) {
    auto* command =
        app.add_subcommand("devices", "List the sensors: driver, formats, and why one cannot be opened");
    auto json = std::make_shared<bool>(false);
    command->add_flag("--json", *json, "print one object");
    command->callback([json, exit] { *exit = list_devices(*json); });
}

}  // namespace burin::cli
