// SPDX-License-Identifier: MIT
#include <cstdio>

#include "cli/common.h"

int main(int argc, char** argv) {
    using namespace burin::cli;
    CLI::App app("Burin: depth frames in, a 3D model out, inside a byte budget", "burin");
    app.set_version_flag("--version", burin_version());
    app.require_subcommand(0, 1);  // none is complained of below: here it would hide a misspelt one
    int exit = kDone;
    add_fuse(app, &exit);
    add_scan(app, &exit);
    add_synth(app, &exit);
    add_mesh(app, &exit);
    add_planes(app, &exit);
    add_render(app, &exit);
    add_convert(app, &exit);
    add_eval(app, &exit);
    add_devices(app, &exit);
    add_record(app, &exit);
    add_config(app, &exit);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) {
            app.exit(error);  // --help, --version
            return kDone;
        }
        return complain(kBadInput, std::string(error.what()) + " (see burin --help)");
    } catch (const std::bad_alloc&) {
        return complain(kFailed, "out of memory");
    } catch (const std::exception& error) {
        return complain(kFailed, error.what());
    }
    if (app.get_subcommands().empty())
        return complain(kBadInput,
                        "no command, expected fuse, scan, synth, mesh, planes, render, convert, eval, "
                        "devices, record or config (see burin --help)");
    return exit;
}
