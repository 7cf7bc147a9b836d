//! What commands look like in use: a command, and what follows the program's name.

/// Two of each command, the plainest first.
pub(super) const EXAMPLES: [(&str, [&str; 2]); 36] = [
    (
        "render",
        [
            "render loft.promenade phrase.flac -o walk.wav --path loft.json",
            "render loft.promenade - -o - --pose 2,3,1.6,90,0,0",
        ],
    ),
    ("host", ["host Promenade.clap phrase.flac -o out.wav --set Yaw=30", "host Promenade.vst3 --list"]),
    ("path", ["path transforms.json -o walk.json --simplify 0.02,1", "path walk.csv"]),
    (
        "bake responses",
        ["bake responses my-room -o my-room.promenade", "bake responses room.sofa -o room.promenade --hold-out every=5"],
    ),
    (
        "bake field",
        ["bake field trained.promenade -o light.promenade", "bake field trained.promenade -o small.promenade --max-mb 4"],
    ),
    (
        "bake less",
        ["bake less hall.promenade -o less.promenade --within 0.5", "bake less hall.promenade -o with-front.promenade"],
    ),
    ("responses manifest", ["responses manifest my-room", "responses manifest my-room --distance 1.5"]),
    (
        "responses ambisonic",
        [
            "responses ambisonic srir --head head.sofa -o brir",
            "responses ambisonic srir --head head.sofa -o brir --normalisation n3d",
        ],
    ),
    (
        "simulate",
        [
            "simulate room.obj --emitter 3,2,1.5 --materials *=brickwork --head head.sofa -o room.promenade",
            "simulate room.obj --up y --emitter 3,2,1.5 --head head.sofa --at 1,1,1.5 -o responses",
        ],
    ),
    (
        "simulate box",
        [
            "simulate box --size 6,4,2.8 --emitter 3,2,1.5 --head head.sofa -o box.promenade",
            "simulate box --size 6,4,2.8 --emitter 3,2,1.5 --materials 0.3 --head head.sofa --poses 50 -o responses",
        ],
    ),
    ("simulate materials", ["simulate materials", "simulate materials > materials.txt"]),
    ("join", ["join out/* -o responses", "join out/part-1 out/part-2 -o responses"]),
    ("surface", ["surface colmap -o room.obj", "surface cloud.ply --shape free --metres-per-unit 0.5 -o room.obj"]),
    (
        "import",
        [
            "import model.safetensors --anchors anchors.safetensors -o scene.promenade",
            "import model.safetensors -o scene.promenade --conv causal",
        ],
    ),
    ("inspect", ["inspect hall.promenade", "inspect hall.promenade --json"]),
    ("measure", ["measure hall.promenade --trade", "measure --response measured.wav --reference rendered.wav"]),
    (
        "map",
        [
            "map room.obj --emitter 3,2,1.5 --materials *=brickwork -o plan.png",
            "map room.obj --emitter 3,2,1.5 --camera 1,1,1.6,45,0,0 -o view.png",
        ],
    ),
    ("map saliency", ["map saliency mix.wav -o curves.svg", "map saliency mix.wav --fps 24 -o - | jq .frames"]),
    (
        "map mix",
        [
            "map mix room.obj picture.png --emitter 3,2,1.5 --sound mix.wav --camera 1,1,1.6,45,0,0 -o maps",
            "map mix room.obj picture.png --emitter 3,2,1.5 --sound mix.wav --camera 1,1,1.6,45,0,0 --strategy image -o maps",
        ],
    ),
    (
        "map composite",
        [
            "map composite image.png sound.png --sound mix.wav -o frames",
            "map composite image.png sound.png --sound mix.wav --fps 60 -o frames",
        ],
    ),
    ("map visibility", ["map visibility reference.png uniform.png mix.png -o visible", "map visibility uniform.png mix.png"]),
    ("fit", ["fit 6,4,2.8 measurements -o fitted.obj", "fit box measurements.sofa -o fitted.promenade --head head.sofa"]),
    (
        "capture from-responses",
        [
            "capture from-responses my-room --dry speech.wav -o walk",
            "capture from-responses room.sofa --dry a.wav b.wav -o walk",
        ],
    ),
    (
        "capture import",
        ["capture import data --layout rwavs -o walk", "capture import data --layout rwavs --rate 48000 -o walk"],
    ),
    ("capture check", ["capture check walk", "capture check walk --json"]),
    ("capture emitter", ["capture emitter walk", "capture emitter walk --write"]),
    ("anchors", ["anchors colmap -o anchors.safetensors", "anchors --box 6,4,2.8 -o anchors.safetensors"]),
    (
        "train",
        [
            "train walk --anchors anchors.safetensors -o trained.promenade",
            "train walk --anchors anchors.safetensors --simulate room.obj --head head.sofa -o trained.promenade",
        ],
    ),
    (
        "learn",
        [
            "learn walk --room room.obj --materials '*=0.2' --head head.sofa -o learnt.promenade",
            "learn walk --room room.obj --head head.sofa --test-emitter door --emitter door -o door.promenade",
        ],
    ),
    (
        "refine",
        [
            "refine measured.sofa --simulate room.obj --head head.sofa --emitter 3,2,1.5 -o refined.promenade",
            "refine measurements --simulate room.obj --evaluate --test-emitter 2",
        ],
    ),
    ("eval", ["eval trained.promenade walk", "eval trained.promenade walk --json figures.json --plot plots"]),
    ("web", ["web loft.promenade --dry phrase.flac --serve", "web loft.promenade --dry phrase.flac --path loft.json -o site"]),
    ("study", ["study study.json -o site", "study - -o site"]),
    ("study serve", ["study serve site --answers answers.csv", "study serve site --answers answers.csv --listen 0.0.0.0:80"]),
    ("study report", ["study report answers.csv", "study report answers.csv --json report.json --plot plots"]),
    ("completions", ["completions bash > ~/.local/share/bash-completion/completions/promenade", "completions -o share"]),
];
