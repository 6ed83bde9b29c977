// Flamenco 3 job type: frames × parts, each frame merged when its parts are there.
// Goes into the Manager's `scripts` folder; workers need `smithwalk` in their PATH, or
// a two-way variable {smithwalk} in the Manager's configuration.

const JOB_TYPE = {
    label: "Smithwalk Render",
    description: "Render an exported scene's frames, each split into parts that add up to the same bits",
    settings: [
        { key: "scene", type: "string", subtype: "file_path", required: true,
          description: "The exported scene.yaml, on storage that all workers share" },
        { key: "frames", type: "string", required: true,
          eval: "f'{C.scene.frame_start}-{C.scene.frame_end}'",
          description: "Frames to render, such as '47', '1-30', '3, 5-10'" },
        { key: "output", type: "string", subtype: "file_path", required: true,
          description: "The images' path with a row of # for the number, such as /shared/out_####.exr" },
        { key: "parts", type: "int32", default: 1,
          description: "Tasks that the samples of a frame are split into" },
        { key: "spp", type: "int32", default: 0,
          description: "Samples per pixel; 0: those of the scene" },
        { key: "smithwalk", type: "string", default: "smithwalk", visible: "submission",
          description: "The program on the workers" },
    ],
};

function compileJob(job) {
    const settings = job.settings;
    // One frame in each chunk.
    for (const frame of frameChunker(settings.frames, 1)) {
        const image = numbered(settings.output, frame);
        if (settings.parts <= 1) {
            job.addTask(renderTask(settings, frame, image, ""));
            continue;
        }
        const films = [];
        const merge = author.Task(`merge-${frame}`, "misc");
        for (let part = 0; part < settings.parts; part++) {
            const film = `${image}.part${part}.film`;
            const task = renderTask(settings, frame, film, `${part}/${settings.parts}`);
            job.addTask(task);
            merge.addDependency(task);
            films.push(film);
        }
        merge.addCommand(author.Command("exec", {
            exe: settings.smithwalk,
            args: ["merge"].concat(films, ["-o", image]),
        }));
        job.addTask(merge);
    }
}

// A task that was interrupted goes on from its own film.
function renderTask(settings, frame, output, part) {
    const args = ["render", settings.scene, `--frames=${frame}..${frame}`, "-o", output,
        "--resume", "--progress", "json"];
    const task = author.Task(part ? `render-${frame}-${part.replace("/", "-of-")}` : `render-${frame}`, "blender");
    task.addCommand(author.Command("exec", {
        exe: settings.smithwalk,
        args: args.concat(part ? ["--part", part] : [], settings.spp > 0 ? ["--spp", `${settings.spp}`] : []),
    }));
    return task;
}

function numbered(path, frame) {
    return path.replace(/#+/, (row) => `${frame}`.padStart(row.length, "0"));
}
