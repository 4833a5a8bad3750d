"""A dataset in an S3 bucket, made by workers that are killed over a line that fails.

    object_store.py PETCOMP RECIPE [-n SAMPLES] [--workers N]

RECIPE is one with its folders, e.g. that of `petcomp demo`; its pictures are made small. The server is moto's, which speaks S3 over HTTP; between it and the workers is a proxy that
loses 5 % of the requests: some before they reach the server, some answered with 503, some whose answer is lost. Three of ten
workers are killed. The bucket then has the bytes that one run writes into a folder, each object once, and no message has
had the secret key in it.
"""

import argparse
import concurrent.futures
import http.client
import logging
import os
import random
import subprocess
import sys
import tempfile
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

SECRET = "a-secret-that-nobody-may-see"
# Workers at a time.
AT_ONCE = 4
BUCKET = "bucket"
PREFIX = "some/prefix"
# Small pictures, four of them in an archive.
SETTINGS = ["scene.image=[128,96]", 'labels.formats=["webdataset"]', "labels.webdataset.samples=4"]
QUOTA = b"<Error><Code>QuotaExceeded</Code><Message>the bucket is full</Message></Error>"


def main():
    options = parse()
    try:
        import boto3
        from moto.server import ThreadedMotoServer
    except ImportError as missing:
        return print(f"skipped: {missing}")
    logging.getLogger("werkzeug").setLevel(logging.ERROR)
    server = ThreadedMotoServer(port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    s3 = boto3.client("s3", endpoint_url=f"http://{host}:{port}", region_name="us-east-1",
                      aws_access_key_id="key", aws_secret_access_key=SECRET)
    s3.create_bucket(Bucket=BUCKET)
    # Each further put of an object would be seen as another version of it.
    s3.put_bucket_versioning(Bucket=BUCKET, VersioningConfiguration={"Status": "Enabled"})
    with tempfile.TemporaryDirectory() as scratch:
        check(options, Line(host, port), s3, Path(scratch))
    server.stop()


def parse():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("petcomp", type=Path)
    parser.add_argument("recipe", type=Path)
    parser.add_argument("-n", "--samples", type=int, default=40)
    parser.add_argument("--workers", type=int, default=10)
    return parser.parse_args()


def check(options, line, s3, scratch):
    run = [str(options.petcomp), "dataset", "generate", str(options.recipe), "-n", str(options.samples), "--yes"]
    for setting in SETTINGS:
        run += ["--set", setting]
    subprocess.run([*run, "-o", str(scratch / "folder"), "-q"], check=True)
    cluster = Cluster(run, line, scratch)

    line.is_full = True
    said = cluster.worker("1/1", "full").communicate()[0]
    expect("QuotaExceeded" in said, f"a full bucket is named: {said}")
    line.is_full = False

    line.failing = 0.05
    killed = cluster.work(options.workers, random.Random(1))
    line.failing = 0
    print(f"{killed} of {options.workers} workers killed, {line.lost} of {line.requests} requests lost")

    expected = files_below(scratch / "folder" / "webdataset")
    made = objects(s3, "webdataset/")
    expect(sorted(made) == sorted(expected), f"no gap and no more: {sorted(made)}")
    expect(made == expected, "the bytes are those of one run")
    versions = s3.list_object_versions(Bucket=BUCKET)["Versions"]
    expect(len(versions) == len({v["Key"] for v in versions}), "nothing was put twice")
    receipts = objects(s3, "receipts/")
    print(f"{len(made)} archives as in a folder, {len(receipts)} receipts, each object once")

    again = cluster.worker("1/1", "again")
    said = again.communicate()[0]
    expect(again.returncode == 0 and " 0 generated now" in said, f"nothing is made again: {said}")
    expect(SECRET not in cluster.said, "no message has the secret key")


class Cluster:
    """Workers that share a bucket and nothing else."""

    def __init__(self, run, line, scratch):
        self.run = run
        self.scratch = scratch
        self.said = ""
        self.environment = dict(
            os.environ,
            AWS_ACCESS_KEY_ID="key",
            AWS_SECRET_ACCESS_KEY=SECRET,
            AWS_REGION="us-east-1",
            AWS_ENDPOINT_URL=line.url,
            AWS_ALLOW_HTTP="true",
        )

    def worker(self, shard, name):
        command = [*self.run, "-o", f"s3://{BUCKET}/{PREFIX}", "--shard", shard, "--scratch", str(self.scratch / name), "-vv"]
        return subprocess.Popen(
            command, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )

    def work(self, count, chance):
        """Runs all workers, kills three of ten once each, and starts again what has not finished."""
        victims = set(chance.sample(range(count), 3 * count // 10))
        killed = len(victims)
        waiting = list(range(count))
        with concurrent.futures.ThreadPoolExecutor(AT_ONCE) as pool:
            for attempt in range(8):
                finish = lambda i: self.finishes(i, count, attempt, victims, chance)
                waiting = [i for i, is_done in zip(waiting, pool.map(finish, waiting)) if not is_done]
                if not waiting:
                    return killed
        raise SystemExit(f"workers {waiting} do not finish:\n{self.said[-3000:]}")

    def finishes(self, index, count, attempt, victims, chance):
        # On another machine each time: nothing of the scratch folder is left.
        worker = self.worker(f"{index + 1}/{count}", f"{index}-{attempt}")
        if index in victims:
            victims.discard(index)
            time.sleep(chance.uniform(0.05, 1.0))
            worker.kill()
        self.said += worker.communicate()[0]
        return worker.returncode == 0


class Line:
    """A proxy before the server; some of what goes over it is lost."""

    def __init__(self, host, port):
        self.upstream = (host, port)
        self.failing = 0
        self.is_full = False
        self.requests = 0
        self.lost = 0
        self.chance = random.Random(7)
        line = self

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def handle_any(self):
                line.forward(self)

            do_GET = do_PUT = do_POST = do_HEAD = do_DELETE = handle_any

            def log_message(self, *_):
                pass

        proxy = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{proxy.server_port}"
        threading.Thread(target=proxy.serve_forever, daemon=True).start()

    def forward(self, request):
        body = request.rfile.read(int(request.headers.get("Content-Length", 0)))
        self.requests += 1
        fate = self.chance.choice(["refused", "cut", "unanswered"]) if self.chance.random() < self.failing else ""
        self.lost += bool(fate)
        if self.is_full and request.command == "PUT":
            return answer(request, 403, {"Content-Type": "application/xml"}, QUOTA)
        if fate == "refused":
            return answer(request, 503, {}, b"slow down")
        if fate == "cut":
            return hang_up(request)
        status, headers, content = self.ask(request, body)
        if fate == "unanswered":
            return hang_up(request)
        answer(request, status, headers, content)

    def ask(self, request, body):
        server = http.client.HTTPConnection(*self.upstream)
        server.request(request.command, request.path, body, dict(request.headers))
        reply = server.getresponse()
        return reply.status, dict(reply.getheaders()), reply.read()


def hang_up(request):
    request.close_connection = True
    request.connection.close()


def answer(request, status, headers, content):
    request.send_response(status)
    for name, value in headers.items():
        if name.lower() not in ("content-length", "transfer-encoding", "connection", "date", "server"):
            request.send_header(name, value)
    length = headers.get("Content-Length", len(content)) if request.command == "HEAD" else len(content)
    request.send_header("Content-Length", str(length))
    request.end_headers()
    request.wfile.write(content)


def files_below(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def objects(s3, folder):
    prefix = f"{PREFIX}/{folder}"
    pages = s3.get_paginator("list_objects_v2").paginate(Bucket=BUCKET, Prefix=prefix)
    keys = [entry["Key"] for page in pages for entry in page.get("Contents", [])]
    return {key[len(prefix):]: s3.get_object(Bucket=BUCKET, Key=key)["Body"].read() for key in keys}


def expect(holds, what):
    if not holds:
        sys.exit(f"failed: {what}")
    print(f"ok: {what.split(':')[0]}")


if __name__ == "__main__":
    main()
