// SPDX-License-Identifier: MIT
// burin convert: any data set into the TUM layout (docs/datasets.md).
#include "datasets/convert.h"

#include <cstdio>

#include "cli/common.h"
#include "cli/source_flags.h"
#include "datasets/open.h"

namespace burin::cli {
namespace {

struct Options {
    std::string source, output, from, format = "tum", frames;
    bool no_colour = false, json = false, quiet = false;
};

void print_notes(const std::string& notes) {
    for (std::size_t at = 0; at < notes.size();) {
        const std::size_t end = notes.find('\n', at);
        std::fprintf(stderr, "burin: %.*s\n", static_cast<int>(end - at), notes.c_str() + at);
        at = end + 1;
    }
}

int run(const Options& o) {
    ConvertOptions options;
    if (!o.frames.empty() && !parse_range(o.frames, &options.begin, &options.end))
        return complain(kBadInput, "--frames: '" + o.frames + "', expected A:B with A < B");
    options.colour = !o.no_colour;
    const auto dataset = open_dataset(o.source, o.from);
    if (!dataset.ok()) return complain_input(dataset.status());
    catch_interrupts();
    ConvertSummary summary;
    Status status;
    {
        Progress progress("convert", std::min(options.end, (*dataset)->frame_count()) - options.begin,
                          o.quiet);
        status = convert_to_tum(
            **dataset, o.output, options,
            [&](int done, int) {
                progress.update(done);
                return !interrupted();
            },
            &summary);
    }
    if (!status.ok()) return complain_output(status);
    if (!o.quiet) print_notes((*dataset)->notes() + summary.notes);
    if (o.json) {
        const nlohmann::json report = {{"output", o.output},
                                       {"format", "tum"},
                                       {"frames", summary.frames},
                                       {"with_colour", summary.with_colour},
                                       {"with_pose", summary.with_pose},
                                       {"with_confidence", summary.with_confidence}};
        std::printf("%s\n", report.dump().c_str());
    } else if (!o.quiet) {
        std::printf("%s: %d frames, %d with colour, %d with a pose\n", o.output.c_str(), summary.frames,
                    summary.with_colour, summary.with_pose);
    }
    return kDone;
}

}  // namespace

void add_convert(CLI::App& app, int* exit) {
    auto* command = app.add_subcommand("convert", "Write a data set in the TUM layout");
    auto o = std::make_shared<Options>();
    command->add_option("dataset", o->source, "folder or file of a data set")->required();
    command->add_option("-o,--output", o->output, "folder for the result, new or empty")->required();
    command->add_option("--format", o->format, "layout to write")
        ->check(CLI::IsMember({"tum"}))
        ->capture_default_str();
    command->add_option("--from", o->from, "layout of the data set (recognised by itself otherwise)");
    command->add_option("--frames", o->frames, "A:B, only frames A..B-1");
    command->add_flag("--no-colour", o->no_colour, "depth alone");
    command->add_flag("--json", o->json, "print a summary on stdout");
    command->add_flag("--quiet", o->quiet, "no progress, no notes");
    command->callback([o, exit] { *exit = run(*o); });
}

}  // namespace burin::cli
