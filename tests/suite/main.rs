//! The tests of the library and of the command line, in one program: it is built and linked once, and tests share
//! references (see `common::truth`). Those that count allocations, limit the memory of their process, or open a
//! window are programs of their own.

#![cfg(feature = "cli")]

#[path = "../common/mod.rs"]
mod common;

mod assets;
mod beams;
mod build_script;
mod chains;
mod chains_on_meshes;
mod chart;
mod chart_report;
mod closed_forms;
mod command_line;
mod command_line_gpu;
mod direct_light;
mod direct_shadows;
mod dispersion;
mod energy;
mod environment;
mod environment_input;
mod environment_without_caustics;
mod error_target;
mod flux_balance;
mod gpu;
mod grazing;
mod lamp;
mod light_map_sizes;
mod merging;
mod mesh_input;
mod mesh_receivers;
mod motion;
mod motion_input;
mod mutated_input;
mod overlays;
mod pinned;
mod reference;
mod reference_view;
mod repeatable;
mod ring;
mod scene_input;
mod seam;
mod stages;
#[cfg(unix)]
mod strangers;
mod stress;
mod structure;
mod textures;
mod transformed;
mod validation;
mod view;
mod water;
mod wide_lights;
